// SPDX-License-Identifier: Apache-2.0
/** @file Triggers of the black box: latched faults of drives or control, and stops. */
#pragma once

#include <array>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "config/config.h"
#include "safety/faults.h"
#include "services/dds/topics.h"

namespace tandem::recorder {

/** Detects events in samples. Any thread. */
class FaultTrigger {
 public:
  /// Topics that the trigger needs, in addition to the configured ones.
  static constexpr std::array kTopics{dds::kActuationState.name, dds::kControlStatus.name, dds::kHalStatus.name,
                                      dds::kStop.name};

  explicit FaultTrigger(const config::Robot& robot) : robot_(robot) {}

  /// @param topic  name below the prefix @return description of an event, if this sample is the first that shows it.
  std::optional<std::string> eventOf(const std::string& topic, std::string_view bytes);

  /// Causes of FAULT of all arms, from the last hal/status; empty if none is in FAULT.
  std::string details() const;

 private:
  /// Last states of all arms, as published by control or by the drive side.
  struct Side {
    bool received = false;
    std::array<bool, safety::kMaxArms> in_fault{};
    std::array<safety::FaultMask, safety::kMaxArms> faults{};
  };
  template <class M>
  std::optional<std::string> eventIn(const M& message, Side& side, const char* who);

  const config::Robot& robot_;
  mutable std::mutex mutex_;
  Side drives_, control_;
  dds::HalStatus status_;
};

}  // namespace tandem::recorder
