// SPDX-License-Identifier: Apache-2.0
#include "hal/can/candump.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace tandem::hal::can {
namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;  // candump sets it in an 8-digit identifier

std::invalid_argument expected(const std::string& what) { return std::invalid_argument("expected " + what); }

std::uint64_t number(std::string_view text, int base, const char* what) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size())
    throw expected(std::string(what) + ", found '" + std::string(text) + "'");
  return value;
}

std::int64_t parseStamp(std::string_view text) {
  const std::size_t dot = text.find('.');
  if (dot == std::string_view::npos || text.size() - dot - 1 == 0 || text.size() - dot - 1 > 9)
    throw expected("a time (SECONDS.MICROSECONDS), found '" + std::string(text) + "'");
  const std::uint64_t seconds = number(text.substr(0, dot), 10, "seconds");
  if (seconds > 9'000'000'000)
    throw expected("seconds below 9e9");
  std::uint64_t fraction = number(text.substr(dot + 1), 10, "a fraction of a second");
  for (std::size_t digits = text.size() - dot - 1; digits < 9; ++digits)
    fraction *= 10;
  return static_cast<std::int64_t>(seconds * 1'000'000'000 + fraction);
}

void parsePayload(std::string_view text, CanFrame& frame) {
  std::size_t digits = 0;
  for (const char c : text) {
    if (c == '.')  // hand-written logs separate bytes by points
      continue;
    if (digits >= 2 * kFdLength)
      throw expected("at most 64 bytes");
    const std::uint64_t nibble = number({&c, 1}, 16, "a hexadecimal digit");
    std::uint8_t& byte = frame.data[digits / 2];
    byte = static_cast<std::uint8_t>(digits % 2 == 0 ? nibble << 4 : byte | nibble);
    ++digits;
  }
  if (digits % 2 != 0)
    throw expected("two digits for each byte");
  frame.length = static_cast<std::uint8_t>(digits / 2);
}

void parseId(std::string_view text, CanFrame& frame) {
  const auto id = static_cast<std::uint32_t>(number(text, 16, "an identifier"));
  if (text.size() == 3) {
    if (id > 0x7FF)
      throw expected("an 11-bit identifier");
    frame.id = id;
  } else if (text.size() == 8) {
    if (id > (kErrorFlag | 0x1FFFFFFF))
      throw expected("a 29-bit identifier");
    frame.error = (id & kErrorFlag) != 0;
    frame.extended = !frame.error;
    frame.id = id & 0x1FFFFFFF;
  } else {
    throw expected("an identifier of 3 or 8 digits, found '" + std::string(text) + "'");
  }
}

CanFrame parseFrame(std::string_view text) {
  CanFrame frame;
  const std::size_t hash = text.find('#');
  if (hash == std::string_view::npos)
    throw expected("ID#DATA, found '" + std::string(text) + "'");
  parseId(text.substr(0, hash), frame);
  std::string_view rest = text.substr(hash + 1);
  if (rest.starts_with('#')) {
    if (rest.size() < 2)
      throw expected("the flags of a CAN FD frame");
    const std::uint64_t flags = number(rest.substr(1, 1), 16, "the flags of a CAN FD frame");
    frame.fd = true;
    frame.bit_rate_switch = (flags & 1) != 0;
    frame.error_state = (flags & 2) != 0;
    parsePayload(rest.substr(2), frame);
  } else if (rest.starts_with('R')) {
    frame.remote = true;
    const std::uint64_t length = rest.size() == 1 ? 0 : number(rest.substr(1), 16, "a length");
    if (length > kClassicLength)
      throw expected("a length of at most 8, found " + std::to_string(length));
    frame.length = static_cast<std::uint8_t>(length);
  } else {
    parsePayload(rest.substr(0, rest.find('_')), frame);  // _9 to _F: a raw length code above 8
  }
  if (!lengthIsValid(frame))
    throw expected("a length that the frame can have, found " + std::to_string(frame.length));
  return frame;
}

std::string_view takeWord(std::string_view& text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r"), text.size());
  const std::size_t end = std::min(text.find_first_of(" \t\r", begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

}  // namespace

LogError::LogError(const std::string& file, std::size_t line, const std::string& reason)
    : std::runtime_error(file + ":" + std::to_string(line) + ": " + reason) {}

LogEntry parseLogLine(const std::string& line) {
  std::string_view rest = line;
  const std::string_view stamp = takeWord(rest), interface = takeWord(rest), text = takeWord(rest);
  if (stamp.size() < 3 || !stamp.starts_with('(') || !stamp.ends_with(')'))
    throw expected("(TIME) INTERFACE FRAME");
  if (interface.empty() || text.empty())
    throw expected("an interface and a frame after the time");
  const std::string_view direction = takeWord(rest), further = takeWord(rest);  // newer candumps append R or T
  if ((!direction.empty() && direction != "R" && direction != "T") || !further.empty())
    throw expected("at most R or T after the frame, found '" + std::string(further.empty() ? direction : further) +
                   "'");
  LogEntry entry{parseFrame(text), std::string(interface)};
  entry.frame.time = parseStamp(stamp.substr(1, stamp.size() - 2));
  return entry;
}

std::string formatLogLine(const CanFrame& frame, const std::string& interface, std::int64_t stamp) {
  char text[64];
  std::snprintf(text, sizeof text, "(%010lld.%06lld) ", static_cast<long long>(stamp / 1'000'000'000),
                static_cast<long long>(stamp % 1'000'000'000 / 1000));
  std::string line = text + interface;
  const bool wide = frame.extended || frame.error;
  std::snprintf(text, sizeof text, wide ? " %08X#" : " %03X#", frame.id | (frame.error ? kErrorFlag : 0u));
  line += text;
  if (frame.fd) {
    std::snprintf(text, sizeof text, "#%X", (frame.bit_rate_switch ? 1 : 0) | (frame.error_state ? 2 : 0));
    line += text;
  }
  if (frame.remote) {
    line += 'R';
    if (frame.length > 0)
      line += std::to_string(frame.length);
  }
  for (const std::uint8_t byte : frame.payload()) {
    std::snprintf(text, sizeof text, "%02X", byte);
    line += text;
  }
  return line;
}

std::vector<LogEntry> readLog(std::istream& in, const std::string& file) {
  std::vector<LogEntry> entries;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#')
      continue;
    try {
      entries.push_back(parseLogLine(line));
    } catch (const std::invalid_argument& error) {
      throw LogError(file, number, error.what());
    }
  }
  return entries;
}

std::vector<LogEntry> readLogFile(const std::string& path) {
  std::ifstream in(path);
  if (!in)
    throw std::runtime_error(path + ": cannot be opened");
  return readLog(in, path);
}

void LogWriter::write(const CanFrame& frame, std::int64_t realtime_offset) {
  out_ << formatLogLine(frame, interface_, frame.time + realtime_offset) << '\n';
}

LogReplayer::LogReplayer(std::vector<LogEntry> entries, double speed) : entries_(std::move(entries)), speed_(speed) {
  if (!(speed > 0.0) || !std::isfinite(speed))
    throw std::invalid_argument("speed of a replay: found " + std::to_string(speed) +
                                ", expected a finite number above zero");
}

std::int64_t LogReplayer::due(std::size_t entry) const noexcept {
  const auto since = static_cast<double>(entries_[entry].frame.time - entries_.front().frame.time);
  return start_ + static_cast<std::int64_t>(since / speed_);
}

std::int64_t LogReplayer::nextTime() const noexcept { return done() ? 0 : due(next_); }

std::size_t LogReplayer::poll(Bus& bus, std::int64_t now) noexcept {
  if (!started_) {
    started_ = true;
    start_ = now;
  }
  std::size_t sent = 0;
  for (; !done() && due(next_) <= now; ++next_) {
    CanFrame frame = entries_[next_].frame;
    frame.time = 0;
    sent += bus.send({&frame, 1});
  }
  return sent;
}

}  // namespace tandem::hal::can
