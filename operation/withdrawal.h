// SPDX-License-Identifier: Apache-2.0
/** @file Withdrawal of an arm in recovery; safety/recovery.h has the order of its joints. */
#pragma once

#include <cstdint>

#include "safety/recovery.h"

namespace tandem::operation {

/** One withdrawal. Nothing allocates, locks or throws. Times are ns. */
class WithdrawalRun {
 public:
  /// Restarts.
  void start() noexcept { *this = {}; }

  /** Velocities for the next control period, m/s; zero once nothing more can be retracted.
   * @param limits of the robot; those of its drives may be narrower: a tube without progress is left where it is
   * @param setpoint from which velocities are integrated, m, rad
   * @param period of control, s */
  safety::ArmVector step(const safety::ArmLimits& limits,
                         const safety::ArmVector& setpoint,
                         safety::JointMask lost,
                         double period,
                         std::int64_t now) noexcept;
  bool done() const noexcept { return done_; }

 private:
  safety::JointMask stuck_ = 0;   ///< joints without progress
  safety::JointMask moving_ = 0;  ///< joints that retract since since_
  safety::ArmVector from_;        ///< setpoint at the last progress
  std::int64_t since_ = 0;
  bool done_ = false;
};

}  // namespace tandem::operation
