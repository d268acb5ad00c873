// SPDX-License-Identifier: Apache-2.0
/** @file The messages of idl/, by the names that the services call them. */
#pragma once

#include "idl/messages.h"

namespace tandem::dds {
using namespace tandem::msg;
using idl::name;
}  // namespace tandem::dds
