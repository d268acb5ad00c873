// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/master_watch.h"

#include <algorithm>

namespace tandem::hal::canopen {

std::string_view name(MasterFrame frame) {
  constexpr std::array<std::string_view, kMasterFrameCount> kNames{"SYNC", "NMT command", "heartbeat under our node id",
                                                                   "command PDO", "SDO request"};
  const auto i = static_cast<std::size_t>(frame);
  return i < kNames.size() ? kNames[i] : std::string_view("unknown");
}

double listeningTime(double heartbeat_budget) noexcept {
  constexpr double kTimes = 3.0, kLeast = 0.5, kMost = 2.0;  // s
  return std::clamp(kTimes * heartbeat_budget, kLeast, kMost);
}

bool MasterWatch::recent(MasterFrame frame, std::int64_t now) const noexcept {
  const Received& received = received_[static_cast<std::size_t>(frame)];
  return received.count != 0 && now - received.last < silence_;
}

bool MasterWatch::note(MasterFrame frame, std::int64_t now) noexcept {
  const bool first = !recent(frame, now);
  Received& received = received_[static_cast<std::size_t>(frame)];
  ++received.count;
  received.last = now;
  return first;
}

bool MasterWatch::commands(std::int64_t now) const noexcept {
  return recent(MasterFrame::kSync, now) || recent(MasterFrame::kNmt, now) || recent(MasterFrame::kHeartbeat, now) ||
         recent(MasterFrame::kCommandPdo, now);
}

bool MasterWatch::receivedAny() const noexcept {
  return std::ranges::any_of(received_, [](const Received& received) { return received.count != 0; });
}

std::string MasterWatch::describe() const {
  std::string text;
  for (int k = 0; k < kMasterFrameCount; ++k) {
    const std::uint64_t count = received_[static_cast<std::size_t>(k)].count;
    if (count == 0)
      continue;
    text += text.empty() ? "" : ", ";
    text += name(static_cast<MasterFrame>(k));
    text += count == 1 ? " (once)" : " (" + std::to_string(count) + " times)";
  }
  return text;
}

}  // namespace tandem::hal::canopen
