// SPDX-License-Identifier: Apache-2.0
/** @file Joint motion of one arm toward the latest target of a CRTK client. */
#pragma once

#include "operation/control_setup.h"
#include "operation/crtk_request.h"

namespace tandem::operation {

/** Checks and follows goals. Nothing allocates after construction, locks or throws. */
class JointStream {
 public:
  JointStream(const ControlSetup& setup, int arm);

  /** Goal of a command for the joints, m and rad, or its velocity, m/s and rad/s.
   * @param here  setpoints of the joints @param following  relative commands add to the previous goal
   * @return false if it is refused; the outcome has the reason */
  bool goalOf(const CrtkVerb& verb,
              const safety::ArmVector& value,
              const safety::ArmVector& here,
              bool following,
              safety::ArmVector& goal,
              CrtkOutcome& outcome) const noexcept;
  /// @param from_rest  start from standstill; otherwise the present velocity continues
  void take(const safety::ArmVector& goal, bool from_rest) noexcept;
  /// Velocities of the next period.
  const safety::ArmVector& step(const CrtkVerb& verb, const safety::ArmVector& here) noexcept;
  const safety::ArmVector& goal() const noexcept { return goal_; }

 private:
  const safety::ArmLimits& limits_;
  const config::Crtk& options_;
  double period_;  ///< s
  safety::ArmVector speed_limit_, acceleration_, goal_, speed_;
};

}  // namespace tandem::operation
