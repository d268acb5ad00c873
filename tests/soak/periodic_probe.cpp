// SPDX-License-Identifier: Apache-2.0
/** @file LD_PRELOAD probe that counts allocations, frees and mutex locks of the periodic thread.
 *
 * It is the thread that sleeps until a point of the monotonic clock (clock_nanosleep with TIMER_ABSTIME), once a cycle.
 * What comes before cycle kStart, and after the last one, does not count. At the end of the process
 * "cycles allocations frees locks" goes to the file that TANDEM_PROBE names, with the process id behind it. */
#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming): glibc's names
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace {

constexpr long kStart = 500;  // cycles
std::atomic<long> cycles{0}, allocations{0}, frees{0}, locks{0};
long at_last_cycle[4] = {};
thread_local bool periodic __attribute__((tls_model("initial-exec"))) = false;

bool counts() { return periodic && cycles.load(std::memory_order_relaxed) > kStart; }

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

void report() {
  const char* base = std::getenv("TANDEM_PROBE");
  if (base == nullptr || at_last_cycle[0] == 0)
    return;
  char path[512];
  std::snprintf(path, sizeof path, "%s.%d", base, getpid());
  if (std::FILE* file = std::fopen(path, "w")) {
    const auto& [n, allocated, freed, locked] = at_last_cycle;
    std::fprintf(file, "%ld %ld %ld %ld\n", n, allocated, freed, locked);
    std::fclose(file);
  }
}

const int kRegistered = std::atexit(report);

}  // namespace

extern "C" {

void* malloc(std::size_t size) {
  allocations += counts() ? 1 : 0;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  allocations += counts() ? 1 : 0;
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  allocations += counts() ? 1 : 0;
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  allocations += counts() ? 1 : 0;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  allocations += counts() ? 1 : 0;
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? 12 : 0;  // ENOMEM
}
void free(void* block) {
  frees += counts() && block != nullptr ? 1 : 0;
  __libc_free(block);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static auto* const real = next<int(pthread_mutex_t*)>("pthread_mutex_lock");
  locks += counts() ? 1 : 0;
  return real(mutex);
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* due, timespec* left) {
  static auto* const real = next<int(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep");
  periodic = periodic || (clock == CLOCK_MONOTONIC && (flags & TIMER_ABSTIME) != 0);
  if (periodic) {
    ++cycles;
    at_last_cycle[0] = cycles, at_last_cycle[1] = allocations, at_last_cycle[2] = frees, at_last_cycle[3] = locks;
  }
  return real(clock, flags, due, left);
}
}
