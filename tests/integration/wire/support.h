// SPDX-License-Identifier: Apache-2.0
/** @file Test helpers: own DDS domain, waiting for events, child processes. */
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "services/dds/bus.h"

namespace tandem::dds {

/// Discovery is slow on a loaded machine.
inline constexpr std::chrono::seconds kDeadline{20};

/// A separate domain and prefix of this test process, so that parallel tests do not receive each other.
inline BusOptions testOptions() {
  BusOptions options;
  options.domain = 1 + static_cast<int>(getpid() % 100);
  options.prefix = "test_" + std::to_string(getpid());
  return options;
}

/** A value under a lock, with a wait for a condition on it. */
template <class T>
class Watched {
 public:
  template <class Change>
  void change(Change change) {
    std::lock_guard lock(mutex_);
    change(value_);
    changed_.notify_all();
  }
  /// @return whether the condition was met in time.
  template <class Condition>
  bool waitUntil(Condition condition, std::chrono::milliseconds limit = kDeadline) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, limit, [&] { return condition(std::as_const(value_)); });
  }
  T get() const {
    std::lock_guard lock(mutex_);
    return value_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  T value_{};
};

/// Calls `act` every few milliseconds until `done`, for conditions without an event. @return whether it was in time.
template <class Done, class Act>
bool repeatUntil(Done done, Act act) {
  std::mutex mutex;
  std::condition_variable never;
  std::unique_lock lock(mutex);
  const auto end = std::chrono::steady_clock::now() + kDeadline;
  while (!done() && std::chrono::steady_clock::now() < end) {
    act();
    never.wait_for(lock, std::chrono::milliseconds(5));
  }
  return done();
}

/** A child process; ends when its standard input closes, at the latest in the destructor. */
class Child {
 public:
  explicit Child(std::vector<std::string> arguments) {
    int input[2], output[2];
    if (pipe2(input, O_CLOEXEC) != 0 || pipe2(output, O_CLOEXEC) != 0) {
      throw std::runtime_error("pipe");
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
    std::vector<char*> list;
    for (std::string& argument : arguments) {
      list.push_back(argument.data());
    }
    list.push_back(nullptr);
    const int error = posix_spawn(&pid_, list[0], &actions, nullptr, list.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(input[0]);
    close(output[1]);
    input_ = input[1];
    output_ = fdopen(output[0], "r");
    if (error != 0) {
      pid_ = -1;
      throw std::runtime_error("cannot start " + arguments[0]);
    }
  }
  ~Child() {
    end();
    std::fclose(output_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// One line of its output without the newline; empty at the end of the output.
  std::string line() {
    char* buffer = nullptr;
    std::size_t size = 0;
    const auto length = getline(&buffer, &size, output_);
    std::string text = length > 0 ? std::string(buffer, static_cast<std::size_t>(length) - 1) : "";
    std::free(buffer);
    return text;
  }

  /// Closes its input and waits. @return its exit status; discards the remaining output.
  int end() {
    if (pid_ > 0) {
      close(input_);
      while (!line().empty()) {
      }
      waitpid(std::exchange(pid_, -1), &status_, 0);
    }
    return status_;
  }
  /// Ends it by SIGKILL, like a crash.
  void crash() {
    kill(pid_, SIGKILL);
    end();
  }

 private:
  pid_t pid_ = -1;
  int status_ = 0;
  int input_ = -1;
  std::FILE* output_ = nullptr;
};

}  // namespace tandem::dds
