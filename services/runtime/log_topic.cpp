// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/log_topic.h"

#include <algorithm>
#include <chrono>

namespace tandem::runtime {

std::uint8_t LogTopic::levelOf(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::trace:
    case spdlog::level::debug:
      return 10;
    case spdlog::level::info:
      return 20;
    case spdlog::level::warn:
      return 30;
    case spdlog::level::err:
      return 40;
    default:
      return 50;
  }
}

bool LogTopic::mayPass(std::int64_t now) {
  if (last_ != 0)
    credit_ = std::min(kBurst, credit_ + kRate * 1e-9 * static_cast<double>(std::max<std::int64_t>(0, now - last_)));
  last_ = now;
  if (credit_ < 1.0) {
    ++left_out_;
    return false;
  }
  credit_ -= 1.0;
  return true;
}

void LogTopic::sink_it_(const spdlog::details::log_msg& line) {
  const std::int64_t now = std::chrono::duration_cast<std::chrono::nanoseconds>(line.time.time_since_epoch()).count();
  if (!mayPass(now))
    return;
  dds::Log message;
  message.stamp = now;
  message.level = levelOf(line.level);
  message.name = service_;
  message.msg.assign(line.payload.data(), line.payload.size());
  if (left_out_ > 0)
    message.msg += " (" + std::to_string(std::exchange(left_out_, 0)) + " earlier lines were dropped)";
  std::replace(message.msg.begin(), message.msg.end(), '\0', ' ');
  if (line.source.filename != nullptr)
    message.file = line.source.filename;
  if (line.source.funcname != nullptr)
    message.function = line.source.funcname;
  message.line = static_cast<std::uint32_t>(std::max(0, line.source.line));
  writer_.write(message);
}

}  // namespace tandem::runtime
