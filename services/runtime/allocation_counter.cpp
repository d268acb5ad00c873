// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/allocation_counter.h"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TANDEM_COUNTS_ALLOCATIONS 1
#else
#define TANDEM_COUNTS_ALLOCATIONS 0
#endif

namespace {
thread_local std::size_t allocation_count = 0;
}  // namespace

#if TANDEM_COUNTS_ALLOCATIONS
// NOLINTBEGIN(readability-identifier-naming): the names of the C library
// Eigen calls malloc itself, so counting operator new would not see it.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* malloc(std::size_t size) {
  ++allocation_count;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocation_count;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++allocation_count;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocation_count;
  return __libc_memalign(alignment, size);
}
}
// NOLINTEND(readability-identifier-naming)
#endif

namespace tandem::runtime {

std::size_t allocationCount() { return allocation_count; }
bool canCountAllocations() { return TANDEM_COUNTS_ALLOCATIONS != 0; }

}  // namespace tandem::runtime
