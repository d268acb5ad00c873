// SPDX-License-Identifier: Apache-2.0
/** @file Counts heap allocations, to show that a piece of code makes none. */
#pragma once

#include <cstddef>

namespace tandem::test {

/// Allocations of the calling thread so far, by malloc, its kin and whatever stands on them (operator new, Eigen).
std::size_t allocationCount();

/// False under sanitizers, which bring their own allocator.
bool canCountAllocations();

}  // namespace tandem::test
