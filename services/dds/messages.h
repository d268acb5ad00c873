// SPDX-License-Identifier: Apache-2.0
/** @file Names of the idl/ messages in namespace tandem::dds. */
#pragma once

#include "idl/messages.h"

namespace tandem::dds {
using namespace tandem::msg;
using idl::name;
}  // namespace tandem::dds
