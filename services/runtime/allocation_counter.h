// SPDX-License-Identifier: Apache-2.0
/** @file Counter of heap allocations, for programs that link the target tandem_allocation_counter. In all others both
 * functions are null. */
#pragma once

#include <cstddef>

namespace tandem::runtime {

/// Allocations of the calling thread so far, by malloc, calloc, realloc, aligned_alloc and callers of these (operator
/// new, Eigen).
[[gnu::weak]] std::size_t allocationCount();

/// False under sanitizers, which have their own allocator.
[[gnu::weak]] bool canCountAllocations();

}  // namespace tandem::runtime
