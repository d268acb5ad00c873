// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/parallel.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace tandem::cli {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kRefresh = std::chrono::milliseconds(100);
constexpr auto kLine = std::chrono::seconds(30);  // of progress in a log

/// "3 min 20 s left", once that can be said.
std::string timeLeft(Clock::duration passed, double part) {
  const double seconds = std::chrono::duration<double>(passed).count();
  if (part <= 0.0 || seconds < 2.0)
    return "";
  const long left = std::lround(seconds * (1.0 - part) / part);
  return (left < 60 ? "" : std::to_string(left / 60) + " min ") + std::to_string(left % 60) + " s left";
}

/** A bar, rewritten in place, on a terminal; a line now and again elsewhere, as in the log of a cluster's job. */
class Progress {
 public:
  Progress(std::string label, std::size_t count) : label_(std::move(label)), count_(count) {}

  void show(std::size_t done) {
    const double part = static_cast<double>(done) / static_cast<double>(count_);
    const auto now = Clock::now();
    if (terminal_) {
      const std::string bar(static_cast<std::size_t>(30.0 * part), '#');
      std::fprintf(stderr, "\r[%-30s] %3.0f %%  %-16s %-18s", bar.c_str(), 100.0 * part, label_.c_str(),
                   timeLeft(now - start_, part).c_str());
    } else if (now - shown_ >= kLine) {
      shown_ = now;
      std::fprintf(stderr, "%s: %zu of %zu, %s\n", label_.c_str(), done, count_, timeLeft(now - start_, part).c_str());
    }
  }
  void end() const {
    if (terminal_)
      std::fprintf(stderr, "\r%-75s\r", "");
  }

 private:
  std::string label_;
  std::size_t count_;
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  Clock::time_point start_ = Clock::now(), shown_ = start_;
};

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
    Progress progress(label, count);
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, kRefresh, [&] { return running == 0; }))
      progress.show(done);
    progress.end();
  }
  if (failure)
    std::rethrow_exception(failure);
}

}  // namespace tandem::cli
