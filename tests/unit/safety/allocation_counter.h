// SPDX-License-Identifier: Apache-2.0
/** @file Counter of heap allocations for tests of code that makes none. */
#pragma once

#include "services/runtime/allocation_counter.h"

namespace tandem::test {

using runtime::allocationCount;
using runtime::canCountAllocations;

}  // namespace tandem::test
