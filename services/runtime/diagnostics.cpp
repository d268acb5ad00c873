// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/diagnostics.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>

#include "services/runtime/identity.h"
#include "services/runtime/log.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/stop_signal.h"

namespace tandem::runtime {

Diagnostics::Diagnostics(dds::Bus& bus, const Setup& setup)
    : bus_(bus),
      service_(setup.name),
      robot_(setup.robot.name),
      writer_(bus.writer(dds::kDiagnostics)),
      time_(setup.deployment.clock == config::ClockMode::kLockStep),
      log_(std::make_shared<LogTopic>(bus, "tandem-" + service_)) {
  addLogSink(log_);
}

Diagnostics::~Diagnostics() {
  removeLogSink(log_);
  const std::string reason = std::uncaught_exceptions() > 0 ? "an error; see its log" : reasonOfStop();
  write(monotonicNow(), Level::kStale, kEnded + (reason.empty() ? "it is done" : reason), {});
  // The sample lies in shared memory of this process, which ends with its participant: readers have to take it before.
  constexpr auto kTaken = std::chrono::milliseconds(100);
  std::this_thread::sleep_for(kTaken);
}

void Diagnostics::write(std::int64_t instant, Level level, const std::string& message, Details values) {
  dds::DiagnosticArray array;
  array.stamp = time_.of(instant);
  dds::DiagnosticStatus status;
  status.level = static_cast<std::uint8_t>(level);
  status.name = "tandem-" + service_;
  status.message = message;
  status.hardware_id = robot_;
  status.values = std::move(values);
  array.status.push_back(std::move(status));
  writer_.write(array);
}

void Diagnostics::publish(std::int64_t instant, Level level, const std::string& message, Details values) {
  const std::int64_t now = monotonicNow();
  constexpr std::int64_t kSecond = 1'000'000'000;
  if (last_ != 0 && now - last_ < kSecond && level == last_level_)
    return;
  last_ = now;
  last_level_ = level;
  const std::vector<std::string> others = mismatches(bus_);
  if (!others.empty())
    level = Level::kError;
  std::uint64_t dropped = 0;
  for (const dds::Dropped& topic : bus_.dropped()) {
    dropped += topic.count;
    values.push_back({kDroppedKey + topic.topic, std::to_string(topic.count) + ": " + topic.why});
  }
  std::string text = message;
  const std::string failed = kFailedKey;
  for (const auto& [key, value] : values) {
    if (!key.starts_with(failed))
      continue;
    text += "; " + key.substr(failed.size()) + ": " + value;
    level = Level::kError;
  }
  for (std::size_t i = 0; i < others.size(); ++i) {
    text += "; " + others[i];
    values.push_back({kMismatchKey + std::to_string(i + 1), others[i]});
  }
  if (dropped != dropped_) {
    spdlog::warn("{} malformed samples dropped so far, the last ones of {}", dropped, values.back().key);
    text += "; malformed samples are dropped";
    level = std::max(level, Level::kWarn);
    dropped_ = dropped;
  }
  write(instant, level, text, std::move(values));
}

}  // namespace tandem::runtime
