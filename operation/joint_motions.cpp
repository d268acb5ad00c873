// SPDX-License-Identifier: Apache-2.0
#include "operation/joint_motions.h"

#include <algorithm>

namespace tandem::operation {

JointMotions::JointMotions(const ControlSetup& setup, const DriveExchange& drives)
    : setup_(setup),
      drives_(drives),
      jog_time_(
          static_cast<std::int64_t>(1e9 * std::max(setup.deployment.budgets.teleoperation, 2.0 * setup.period()))) {}

void JointMotions::moveTo(int k, const safety::ArmVector& goal) noexcept {
  Arm& arm = at(k);
  arm.kind = Kind::kGoal;
  arm.motion = safety::JointMotion(setup_.limits(k), setup_.of(k, drives_.setpoints()), goal);
  arm.time = 0.0;
  arm.homing = false;
  arm.verb = CrtkSnapshot::kNone;
}

bool JointMotions::take(const CrtkRequest& request, CrtkOutcome& outcome) noexcept {
  std::array<safety::ArmVector, 2> goals;
  const double* value = request.values.data();
  for (int k = request.firstArm(); k <= request.lastArm(); value += setup_.model.size(k), ++k) {
    safety::ArmVector& goal = goals[static_cast<std::size_t>(k - request.firstArm())];
    goal = safety::ArmVector::Map(value, setup_.model.size(k));
    if (verbOf(request.verb).kind == CrtkKind::kRelative)
      goal += setup_.of(k, drives_.setpoints());
    if (!isReachable(goal, setup_.limits(k), outcome))
      return false;
  }
  for (int k = request.firstArm(); k <= request.lastArm(); ++k) {
    moveTo(k, goals[static_cast<std::size_t>(k - request.firstArm())]);
    at(k).verb = static_cast<std::uint8_t>(request.verb);
    at(k).group = static_cast<std::uint8_t>(request.group);
  }
  return true;
}

void JointMotions::home(int k) noexcept {
  moveTo(k, setup_.robot.arms[static_cast<std::size_t>(k)].home);
  at(k).homing = true;
}

void JointMotions::jog(int k, const safety::ArmVector& velocity, std::int64_t now) noexcept {
  at(k).kind = Kind::kJog;
  at(k).jog_velocity = velocity;
  at(k).jog_until = now + jog_time_;
}

void JointMotions::withdraw(int k) noexcept {
  at(k).kind = Kind::kWithdraw;
  at(k).withdrawal.start();
}

bool JointMotions::anyActive() const noexcept {
  return std::any_of(arms_.begin(), arms_.end(), [](const Arm& arm) { return arm.kind != Kind::kNone; });
}

void JointMotions::step(int k, bool recovering, std::int64_t now, Velocities& velocities) noexcept {
  Arm& arm = at(k);
  if (arm.kind == Kind::kJog && now > arm.jog_until)
    end(k);
  if (arm.kind == Kind::kNone)
    return;
  bool& moves = velocities.moves[static_cast<std::size_t>(k)];
  moves = true;
  auto velocity = setup_.of(k, velocities.value);
  if (arm.kind == Kind::kGoal) {
    velocity = towardGoal(k);
  } else if (arm.kind == Kind::kJog) {
    velocity = jogged(k, recovering);
  } else {
    velocity = arm.withdrawal.step(setup_.limits(k), setup_.of(k, drives_.setpoints()),
                                   drives_.state().lost[static_cast<std::size_t>(k)], setup_.period(), now);
    moves = !arm.withdrawal.done();
    if (!moves)
      end(k);
  }
}

safety::ArmVector JointMotions::towardGoal(int k) noexcept {
  // Rate of correction after lost commands, 1/s. Corrections are made only from a new state: in an old one the distance
  // travelled since also appears as an error.
  constexpr double kCatchUpRate = 20.0;
  constexpr double kTimeout = 10.0;  // s; after this time the motion ends although its joints have not arrived
  Arm& arm = at(k);
  const double period = setup_.period();
  const safety::ArmVector before = arm.motion.position(arm.time);
  arm.time += period;
  safety::ArmVector velocity = (arm.motion.position(arm.time) - before) / period;
  if (drives_.fresh())
    velocity += std::min(1.0 / period, kCatchUpRate) * (before - setup_.of(k, drives_.setpoints()));
  for (int j = 0; j < setup_.model.size(k); ++j) {
    const double limit = safety::moveVelocity(setup_.limits(k), j);
    velocity[j] = std::clamp(velocity[j], -limit, limit);
  }
  const bool late = arm.motion.finished(arm.time - kTimeout);
  if (arm.motion.finished(arm.time - period) && (arrived(k) || late)) {
    arm.unhomed = arm.unhomed && !arm.homing;
    end(k);
  }
  return velocity;
}

/// The motion ends when the joints have arrived and the last command has zero velocity. The last setpoint alone is not
/// sufficient: it may be lost, and drives continue beyond the end of a segment with a velocity.
bool JointMotions::arrived(int k) const noexcept {
  constexpr double kArrived = 1e-7;  // m or rad
  const safety::ArmVector& goal = at(k).motion.goal();
  const double asked = (setup_.of(k, drives_.setpoints()) - goal).cwiseAbs().maxCoeff();
  const double measured = (setup_.of(k, drives_.measured()) - goal).cwiseAbs().maxCoeff();
  const double step = setup_.period() * setup_.of(k, drives_.lastSent()).cwiseAbs().maxCoeff();
  return std::max(asked, step) <= kArrived && measured <= safety::kPositionTolerance;
}

safety::ArmVector JointMotions::jogged(int k, bool recovering) const noexcept {
  safety::ArmVector velocity = at(k).jog_velocity;
  for (int j = 0; recovering && j < velocity.size(); ++j) {
    const double most =
        safety::recoveryVelocity(setup_.limits(k), drives_.state().lost[static_cast<std::size_t>(k)], j);
    velocity[j] = std::clamp(velocity[j], -most, most);
  }
  return velocity;
}

void JointMotions::fill(CrtkSnapshot& snapshot) const noexcept {
  for (int k = 0; k < setup_.arms(); ++k) {
    const Arm& arm = at(k);
    if (arm.kind != Kind::kGoal)
      continue;
    snapshot.has_js[static_cast<std::size_t>(k)] = 1;
    for (int j = 0; j < setup_.model.size(k); ++j)
      snapshot.js[msg::jointIndex(k, j)] = arm.motion.goal()[j];
    if (arm.verb != CrtkSnapshot::kNone)
      snapshot.active[arm.group] = arm.verb;
  }
}

}  // namespace tandem::operation
