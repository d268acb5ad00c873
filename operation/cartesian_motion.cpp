// SPDX-License-Identifier: Apache-2.0
#include "operation/cartesian_motion.h"

#include <algorithm>
#include <numbers>

namespace tandem::operation {
namespace {

namespace teleoperation = planning::teleoperation;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using kinematics::TaskPlace;

constexpr double kThere = 5e-5;        ///< distance at which a tip has reached its goal, m
constexpr double kNearer = 1e-5;       ///< smallest decrease of the distance that counts as progress, m
constexpr double kThereAngle = 2e-3;   ///< the same of orientations, rad
constexpr double kNearerAngle = 4e-4;  ///< rad

constexpr double degrees(double angle) noexcept { return 180.0 / std::numbers::pi * angle; }

}  // namespace

CartesianMotion::CartesianMotion(const ControlSetup& setup, bool pair)
    : rotation_(setup.deployment.teleoperation.options.rotation),
      options_(setup.deployment.teleoperation.crtk),
      response_(teleoperation::responseTime(setup.deployment.teleoperation.options.guard, setup.period())),
      pair_(pair),
      rotates_(!pair && rotation_.followed != teleoperation::TipOrientation::kIgnored),
      position_(teleoperation::TipRegions(setup.deployment.teleoperation.options.guard),
                teleoperation::leashOf(setup.deployment.teleoperation.options.guard, setup.period()),
                options_.acceleration,
                setup.period()),
      orientation_(teleoperation::FreeOrientations(rotation_.space(), rotation_.max_speed),
                   teleoperation::angleLeashOf(setup.deployment.teleoperation.options, setup.period()),
                   options_.angular_acceleration,
                   setup.period()) {}

TaskPlace CartesianMotion::goalOf(const CrtkRequest& request, const TaskPlace& setpoint) const noexcept {
  const Vector3d value = Vector3d::Map(request.values.data());
  const Quaterniond rotation = Quaterniond(Eigen::Vector4d(request.orientation.data())).normalized();
  switch (verbOf(request.verb).kind) {
    case CrtkKind::kPosition:
      return {value, rotation};
    case CrtkKind::kRelative:
      return {setpoint.position + value, (rotation * setpoint.orientation).normalized()};
    case CrtkKind::kVelocity:
      break;
  }
  return setpoint;
}

bool CartesianMotion::admits(const CrtkRequest& request,
                             const TaskPlace& setpoint,
                             CrtkOutcome& outcome) const noexcept {
  if (verbOf(request.verb).level != CrtkLevel::kServo)
    return true;
  const TaskPlace goal = goalOf(request, setpoint);
  const double step = position_.distance(goal.position, setpoint.position);
  const double angle = orientation_.distance(goal.orientation, setpoint.orientation);
  if (step > options_.tip_step) {
    outcome.refuse(
        "found a step of %.3f mm from the last goal, expected at most %.3f mm (tip_step); use interpolate or move",
        1e3 * step, 1e3 * options_.tip_step);
  } else if (rotates_ && angle > options_.tip_rotation_step) {
    outcome.refuse(
        "found a rotation of %.3f deg from the last goal, expected at most %.3f deg (tip_rotation_step); use "
        "interpolate or move",
        degrees(angle), degrees(options_.tip_rotation_step));
  } else {
    return true;
  }
  return false;
}

void CartesianMotion::start(const TaskPlace& now) noexcept {
  position_.engage(now.position);
  orientation_.engage(now.orientation);
}

void CartesianMotion::take(const CrtkRequest& request, const TaskPlace& setpoint, std::int64_t now) noexcept {
  const TaskPlace goal = goalOf(request, setpoint);
  position_.setGoal(goal.position, Vector3d::Map(request.values.data()));
  orientation_.setGoal(goal.orientation, Vector3d::Map(request.angular.data()));
  nearer_at_ = now;
}

void CartesianMotion::advance(const CrtkVerb& verb,
                              const TaskPlace& now,
                              const teleoperation::DrivenTips& tips) noexcept {
  position_.advance(verb, now.position, tips);
  if (rotates_)
    orientation_.advance(verb, now.orientation, {});
}

bool CartesianMotion::reached(const TaskPlace& place, std::int64_t now) noexcept {
  const bool nearer = position_.approaches(place.position, kNearer);
  if ((rotates_ && orientation_.approaches(place.orientation, kNearerAngle)) || nearer)
    nearer_at_ = now;
  return position_.distance(position_.goal(), place.position) <= kThere &&
         (!rotates_ || orientation_.distance(orientation_.goal(), place.orientation) <= kThereAngle);
}

planning::TaskReference CartesianMotion::taskTo(planning::TaskKind kind,
                                                int arm,
                                                const Vector3d& target,
                                                const Vector3d& now,
                                                double gain) const noexcept {
  return {kind, arm, 1, target, std::max(0.0, 1.0 / response_ - gain) * (target - now)};
}

planning::TaskReference CartesianMotion::orientationTask(int arm, const Quaterniond& now, double gain) const noexcept {
  planning::TaskReference task;
  task.kind = teleoperation::taskOf(rotation_.followed);
  task.arm = arm;
  task.orientation = orientation_.target();
  task.angular_feed_forward =
      std::max(0.0, 1.0 / response_ - gain) * orientation_.difference(orientation_.target(), now);
  return task;
}

void CartesianMotion::fill(const CrtkVerb& verb, std::size_t group, CrtkSnapshot& snapshot) const noexcept {
  if (verb.kind == CrtkKind::kVelocity) {
    snapshot.has_cv[group] = 1;
    Vector3d::Map(snapshot.cv[group].data()) = position_.asked();
    if (rotates_)
      Vector3d::Map(snapshot.cv_angular[group].data()) = orientation_.asked();
    return;
  }
  snapshot.has_cp[group] = 1;
  Vector3d::Map(snapshot.cp[group].data()) = position_.goal();
  if (rotates_)
    Eigen::Vector4d::Map(snapshot.cp_orientation[group].data()) = orientation_.goal().coeffs();
}

}  // namespace tandem::operation
