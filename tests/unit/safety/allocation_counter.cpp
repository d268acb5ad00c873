// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/safety/allocation_counter.h"

#include <atomic>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TANDEM_COUNTS_ALLOCATIONS 1
#else
#define TANDEM_COUNTS_ALLOCATIONS 0
#endif

namespace {
std::atomic<std::size_t> allocation_count{0};
}  // namespace

#if TANDEM_COUNTS_ALLOCATIONS
// Eigen calls malloc itself, so counting operator new would not see it.
extern "C" {
void* __libc_malloc(std::size_t size);
void* malloc(std::size_t size) {
  allocation_count.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
}
#endif

namespace tandem::test {

std::size_t allocationCount() { return allocation_count.load(std::memory_order_relaxed); }
bool canCountAllocations() { return TANDEM_COUNTS_ALLOCATIONS != 0; }

}  // namespace tandem::test
