// SPDX-License-Identifier: Apache-2.0
#include "operation/withdrawal.h"

#include <algorithm>

namespace tandem::operation {
safety::ArmVector WithdrawalRun::step(const safety::ArmLimits& limits,
                                      const safety::ArmVector& setpoint,
                                      safety::JointMask lost,
                                      double period,
                                      std::int64_t now) noexcept {
  // After this time without progress, a limit known only to the drives blocks the tube, ns.
  constexpr std::int64_t kTimeout = 2'000'000'000;
  const bool progress =
      from_.size() != setpoint.size() || (setpoint - from_).cwiseAbs().maxCoeff() > 0.1 * safety::kPositionTolerance;
  if (progress) {
    from_ = setpoint;
    since_ = now;
  } else if (now - since_ > kTimeout) {
    stuck_ |= moving_;
    since_ = now;
  }
  const auto held = static_cast<safety::JointMask>(lost | stuck_);
  const double speed = safety::recoveryVelocity(limits, 0, 0);  // all translations have the same speed
  const safety::Withdrawal next = safety::nextWithdrawal(limits, setpoint, held, speed * period);
  moving_ = next.joints;
  done_ = next.joints == 0;
  safety::ArmVector velocity = safety::ArmVector::Zero(setpoint.size());
  for (int j = 0; j < static_cast<int>(setpoint.size()); ++j) {
    if ((next.joints & safety::jointBit(j)) != 0)
      velocity[j] = -next.distance / period;
  }
  return velocity;
}

}  // namespace tandem::operation
