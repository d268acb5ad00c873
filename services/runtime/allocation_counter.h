// SPDX-License-Identifier: Apache-2.0
/** @file Counter of heap allocations. Programs that link the target tandem_allocation_counter have it; in others both
 * functions are null. */
#pragma once

#include <cstddef>

namespace tandem::runtime {

/// Allocations of the calling thread so far, by malloc, its kin and whatever stands on them (operator new, Eigen).
[[gnu::weak]] std::size_t allocationCount();

/// False under sanitizers, which bring their own allocator.
[[gnu::weak]] bool canCountAllocations();

}  // namespace tandem::runtime
