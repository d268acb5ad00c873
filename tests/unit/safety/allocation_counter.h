// SPDX-License-Identifier: Apache-2.0
/** @file Counts heap allocations, to show that a piece of code makes none. */
#pragma once

#include "services/runtime/allocation_counter.h"

namespace tandem::test {

using runtime::allocationCount;
using runtime::canCountAllocations;

}  // namespace tandem::test
