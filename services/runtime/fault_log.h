// SPDX-License-Identifier: Apache-2.0
/** @file Log of arm faults: one entry per fault, with its cause. */
#pragma once

#include <array>
#include <string>

#include "config/config.h"
#include "safety/dimensions.h"
#include "safety/faults.h"

namespace tandem::runtime {

/** Fault of one arm, passed from a periodic thread to the logging thread. */
struct FaultReport {
  int arm = 0;
  safety::FaultRecord record;
  double late = 0.0;  ///< largest lateness of the process's own loop in the last seconds, s
};

/** Distinguishes new faults from reported ones. */
class FaultWatch {
 public:
  /// Whether this record of an arm is new. Call it with every record, also with empty ones.
  bool fresh(int arm, const safety::FaultRecord& record) noexcept {
    safety::FaultMask& reported = reported_[static_cast<std::size_t>(arm)];
    const bool is_new = record.faults != 0 && reported == 0;
    reported = record.faults;
    return is_new;
  }
  /// Calls `report` with a FaultReport for each arm whose record, `core.faultRecord(arm)`, is new.
  template <class Core, class Report>
  void look(const Core& core, int arm_count, Report report) noexcept {
    for (int k = 0; k < arm_count; ++k) {
      if (fresh(k, core.faultRecord(k)))
        report(FaultReport{k, core.faultRecord(k), 0.0});
    }
  }

 private:
  std::array<safety::FaultMask, safety::kMaxArms> reported_{};
};

/// "arm_a: drive (following error) of joint 4: 0.031 rad, allowed 0.02 rad"; for a timing fault also the wake-up delay
/// of this PC.
std::string describe(const config::Robot& robot, const FaultReport& report);

/// Writes the fault to the log. Not for the periodic thread.
void logFault(const config::Robot& robot, const FaultReport& report);

}  // namespace tandem::runtime
