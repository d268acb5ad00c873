// SPDX-License-Identifier: Apache-2.0
/** @file Logging: "[time] [service] [level] text" on stderr, written by a thread of its own. */
#pragma once

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "services/common/outbox.h"

namespace tandem::service {

/** Makes the process's logger; afterwards spdlog::info() and friends go through it.
 * @param service its name in every line.
 * @param level trace, debug, info, warn, error, critical or off; empty: environment variable TANDEM_LOG, else info.
 * @throw std::invalid_argument for an unknown level. */
void startLog(const std::string& service, const std::string& level = "");

/// Sends the lines to one more place, besides stderr, from the thread of the log; any thread may add or remove one.
void addLogSink(const spdlog::sink_ptr& sink);
void removeLogSink(const spdlog::sink_ptr& sink);

/// Writes what is pending and ends the log's thread. Call it before main() ends.
void stopLog();

/** Log of a periodic thread: formats into a fixed buffer and hands over through an Outbox; no allocation, no lock.
 * Lines are cut at 240 bytes; where the ring is full they are dropped, and the next line tells how many. */
class PeriodicLog {
 public:
  /// Opens a channel: before outbox.start(). Lines go to the default logger unless one is given.
  explicit PeriodicLog(Outbox& outbox, std::shared_ptr<spdlog::logger> logger = nullptr);

  template <class... Arguments>
  void info(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
    post(spdlog::level::info, format, std::forward<Arguments>(arguments)...);
  }
  template <class... Arguments>
  void warn(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
    post(spdlog::level::warn, format, std::forward<Arguments>(arguments)...);
  }
  template <class... Arguments>
  void error(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
    post(spdlog::level::err, format, std::forward<Arguments>(arguments)...);
  }

  /// Lines dropped so far.
  std::uint64_t dropped() const { return ring_->dropped(); }

 private:
  struct Line {
    spdlog::level::level_enum level;
    std::uint32_t length;
    std::uint64_t dropped_before;
    std::array<char, 240> text;
  };

  template <class... Arguments>
  void post(spdlog::level::level_enum level,
            fmt::format_string<Arguments...> format,
            Arguments&&... arguments) noexcept {
    // Any other argument could throw, or allocate in its formatter.
    static_assert(((std::is_arithmetic_v<std::decay_t<Arguments>> ||
                    std::is_convertible_v<std::decay_t<Arguments>, std::string_view>)&&...),
                  "numbers and texts only");
    Line line{level, 0, dropped(), {}};
    const auto result =
        fmt::format_to_n(line.text.data(), line.text.size(), format, std::forward<Arguments>(arguments)...);
    line.length = static_cast<std::uint32_t>(std::min(result.size, line.text.size()));
    ring_->post(line);
  }

  void print(const Line& line);

  std::shared_ptr<spdlog::logger> logger_;
  std::uint64_t reported_ = 0;  // dropped lines told so far; publisher thread
  Outbox::Queue<Line>* ring_;
};

}  // namespace tandem::service
