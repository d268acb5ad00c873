// SPDX-License-Identifier: Apache-2.0
#include "operation/joint_stream.h"

#include "operation/smooth_motion.h"
#include "safety/joint_motion.h"

namespace tandem::operation {

JointStream::JointStream(const ControlSetup& setup, int arm)
    : limits_(setup.limits(arm)), options_(setup.deployment.teleoperation.crtk), period_(setup.period()) {
  const int n = setup.model.size(arm);
  speed_limit_.resize(n);
  acceleration_.resize(n);
  goal_.setZero(n);
  speed_.setZero(n);
  for (int j = 0; j < n; ++j) {
    speed_limit_[j] = safety::moveVelocity(limits_, j);
    acceleration_[j] = safety::moveAcceleration(limits_, j);
  }
}

bool JointStream::goalOf(const CrtkVerb& verb,
                         const safety::ArmVector& value,
                         const safety::ArmVector& here,
                         bool following,
                         safety::ArmVector& goal,
                         CrtkOutcome& outcome) const noexcept {
  goal = value;
  if (verb.kind == CrtkKind::kVelocity)
    return true;
  if (verb.kind == CrtkKind::kRelative)
    goal += following ? goal_ : here;
  if (!isReachable(goal, limits_, outcome))
    return false;
  const int n = static_cast<int>(goal.size());
  for (int j = 0; verb.level == CrtkLevel::kServo && j < n; ++j) {
    const bool translation = limits_.isTranslation(j);
    const double most = translation ? options_.translation_step : options_.rotation_step;
    const double step = std::abs(goal[j] - here[j]);
    if (step <= most)
      continue;
    outcome.refuse("joint %d: found a step of %.4g %s, expected at most %.4g (%s_step); use interpolate or move", j + 1,
                   translation ? 1e3 * step : step, translation ? "mm" : "rad", translation ? 1e3 * most : most,
                   translation ? "translation" : "rotation");
    return false;
  }
  return true;
}

void JointStream::take(const safety::ArmVector& goal, bool from_rest) noexcept {
  goal_ = goal;
  if (from_rest)
    speed_.setZero();
}

const safety::ArmVector& JointStream::step(const CrtkVerb& verb, const safety::ArmVector& here) noexcept {
  const bool smooth = verb.level != CrtkLevel::kServo;
  if (verb.kind == CrtkKind::kVelocity) {
    const safety::ArmVector asked = goal_.cwiseMin(speed_limit_).cwiseMax(-speed_limit_);
    speed_ = smooth ? rampedVelocity(asked, speed_, acceleration_, period_) : asked;
  } else if (smooth) {
    speed_ = smoothVelocity(safety::ArmVector(goal_ - here), speed_, speed_limit_, acceleration_, period_);
  } else {
    speed_ = ((goal_ - here) / period_).cwiseMin(speed_limit_).cwiseMax(-speed_limit_);
  }
  return speed_;
}

}  // namespace tandem::operation
