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

/** Looks at samples as they come. Any thread. */
class FaultTrigger {
 public:
  /// What it needs to see, whatever else is kept.
  static constexpr std::array kTopics{dds::kActuationState.name, dds::kControlStatus.name, dds::kHalStatus.name,
                                      dds::kStop.name};

  explicit FaultTrigger(const config::Robot& robot) : robot_(robot) {}

  /// @param topic  name below the prefix @return what happened, for people, where this sample is the first to say so.
  std::optional<std::string> look(const std::string& topic, std::string_view bytes);

  /// What led each arm into FAULT, as hal or sim said last; empty where none is.
  std::string details() const;

 private:
  /// What one side last said of its arms.
  struct Side {
    bool received = false;
    std::array<bool, safety::kMaxArms> in_fault{};
    std::array<safety::FaultMask, safety::kMaxArms> faults{};
  };
  template <class M>
  std::optional<std::string> lookAt(const M& message, Side& side, const char* who);

  const config::Robot& robot_;
  mutable std::mutex mutex_;
  Side drives_, control_;
  dds::HalStatus status_;
};

}  // namespace tandem::recorder
