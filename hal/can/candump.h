// SPDX-License-Identifier: Apache-2.0
/** @file Log format of candump: "(1436509052.249713) vcan0 044#2A366C2BBA", one frame per line. */
#pragma once

#include <fstream>
#include <istream>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/can/bus.h"

namespace tandem::hal::can {

/** A line of a log that cannot be read. what(): "FILE:LINE: reason". */
class LogError : public std::runtime_error {
 public:
  LogError(const std::string& file, std::size_t line, const std::string& reason);
};

/** One line: frame, time, interface. `frame.time` is the log's time, ns since the epoch. */
struct LogEntry {
  CanFrame frame;
  std::string interface;
};

/// Parses one line. @throw std::invalid_argument with the reason.
LogEntry parseLogLine(const std::string& line);
/// The line for a frame seen at `stamp` (ns since the epoch), without end of line. Times are cut to microseconds.
std::string formatLogLine(const CanFrame& frame, const std::string& interface, std::int64_t stamp);

/// Reads a whole log; empty lines and lines that begin with # are skipped. @throw LogError.
std::vector<LogEntry> readLog(std::istream& in, const std::string& file);
/// @throw LogError, std::runtime_error if the file cannot be opened.
std::vector<LogEntry> readLogFile(const std::string& path);

/** Writes a log, one line per frame. Formats and writes at once: not for a periodic thread. */
class LogWriter {
 public:
  LogWriter(std::ostream& out, std::string interface) : out_(out), interface_(std::move(interface)) {}
  /// @param realtime_offset realtime minus monotonic clock, added to frame.time, ns; see realtimeOffset().
  void write(const CanFrame& frame, std::int64_t realtime_offset);

 private:
  std::ostream& out_;
  std::string interface_;
};

/** Sends a log again with its original intervals between frames. */
class LogReplayer {
 public:
  /// @param speed 2: twice as fast as recorded. @throw std::invalid_argument unless positive.
  LogReplayer(std::vector<LogEntry> entries, double speed = 1.0);

  /// Sends the frames that are due. The first call starts with the first frame. @return frames sent by this call.
  std::size_t poll(Bus& bus, std::int64_t now) noexcept;
  bool done() const noexcept { return next_ == entries_.size(); }
  /// Due time of the next frame, ns monotonic; undefined before the first poll() and when done().
  std::int64_t nextTime() const noexcept;

 private:
  std::int64_t due(std::size_t entry) const noexcept;

  std::vector<LogEntry> entries_;
  double speed_;
  std::size_t next_ = 0;
  std::int64_t start_ = 0;
  bool started_ = false;
};

}  // namespace tandem::hal::can
