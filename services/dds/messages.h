// SPDX-License-Identifier: Apache-2.0
/** @file Aliases of the messages of idl/ for the services. */
#pragma once

#include "idl/messages.h"

namespace tandem::dds {
using namespace tandem::msg;
using idl::name;
}  // namespace tandem::dds
