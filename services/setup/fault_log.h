// SPDX-License-Identifier: Apache-2.0
/** @file Faults of arms as services tell them: once, with what led to them. */
#pragma once

#include <array>
#include <string>

#include "config/config.h"
#include "safety/dimensions.h"
#include "safety/faults.h"

namespace tandem::service {

/** A fault of one arm, as a periodic thread hands it to the thread that logs. */
struct FaultReport {
  int arm = 0;
  safety::FaultRecord record;
};

/** Tells new faults from those that have been told. */
class FaultWatch {
 public:
  /// Whether this record of an arm is a new one. Call it with every record, the empty ones included.
  bool fresh(int arm, const safety::FaultRecord& record) noexcept {
    safety::FaultMask& told = told_[static_cast<std::size_t>(arm)];
    const bool is_new = record.faults != 0 && told == 0;
    told = record.faults;
    return is_new;
  }

 private:
  std::array<safety::FaultMask, safety::kMaxArms> told_{};
};

/// "arm_a: drive (following error) of joint 4: 0.031 rad, allowed 0.02 rad".
std::string describe(const config::Robot& robot, const FaultReport& report);

/// Writes it to the log. Not for the periodic thread.
void logFault(const config::Robot& robot, const FaultReport& report);

}  // namespace tandem::service
