// SPDX-License-Identifier: Apache-2.0
#include "services/cli/parallel.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace tandem::cli {
namespace {

constexpr auto kRefresh = std::chrono::milliseconds(100);

void show(const std::string& label, std::size_t done, std::size_t count) {
  const double part = static_cast<double>(done) / static_cast<double>(count);
  const std::string bar(static_cast<std::size_t>(30.0 * part), '#');
  std::fprintf(stderr, "\r[%-30s] %3.0f %%  %-28s", bar.c_str(), 100.0 * part, label.c_str());
}

}  // namespace

void parallelFor(std::size_t count,
                 int threads,
                 const std::string& label,
                 const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next = 0, done = 0;
  std::mutex mutex;
  std::condition_variable ended;
  std::exception_ptr failure;
  int running = threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) {
        body(i);
        ++done;
      }
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure)
        failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    --running;
    ended.notify_all();
  };
  {
    std::vector<std::jthread> workers;
    const int started = running;
    for (int i = 0; i < started; ++i)
      workers.emplace_back(work);
    const bool terminal = isatty(STDERR_FILENO) != 0;
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, kRefresh, [&] { return running == 0; })) {
      if (terminal)
        show(label, done, count);
    }
    if (terminal)
      std::fprintf(stderr, "\r%-75s\r", "");
  }
  if (failure)
    std::rethrow_exception(failure);
}

}  // namespace tandem::cli
