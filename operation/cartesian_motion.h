// SPDX-License-Identifier: Apache-2.0
/** @file Cartesian motion of one CRTK group: targets of its position and its orientation on their way to a goal. */
#pragma once

#include "operation/control_setup.h"
#include "operation/crtk_request.h"
#include "operation/smooth_motion.h"
#include "planning/reference_tracker.h"
#include "planning/teleoperation/pipeline.h"

namespace tandem::operation {

/** Target of a position, m, or an orientation, rad, robot base frame. */
template <class Bounds>
class CartesianTrack {
 public:
  using Guard = planning::teleoperation::TargetGuard<Bounds>;
  using Point = typename Guard::Point;

  /// @param leash  largest distance of the target ahead of the tip; @param acceleration  of interpolate and move
  CartesianTrack(const Bounds& bounds, double leash, double acceleration, double period)
      : guard_(bounds), max_speed_(bounds.maxSpeed()), leash_(leash), acceleration_(acceleration), period_(period) {}

  void engage(const Point& now) noexcept {
    guard_.engage(now);
    speed_.setZero();
  }
  /// @param velocity  of cv, per second
  void setGoal(const Point& goal, const Eigen::Vector3d& velocity) noexcept {
    goal_ = goal;
    asked_ = velocity;
    nearest_ = safety::kUnlimited;
  }
  /// Moves the target by one period.
  void advance(const CrtkVerb& verb, const Point& now, const typename Bounds::Body& body) noexcept {
    const Point before = guard_.target(), next = wanted(verb);
    guard_.step(next, now, body, leash_, period_);
    speed_ = difference(guard_.target(), before) / period_;
  }
  /// Notes the distance to the goal. @param least  smallest decrease that counts. @return whether it has decreased
  bool approaches(const Point& now, double least) noexcept {
    const double away = distance(goal_, now);
    const bool nearer = away < nearest_ - least;
    nearest_ = nearer ? away : nearest_;
    return nearer;
  }

  Eigen::Vector3d difference(const Point& to, const Point& from) const noexcept {
    return guard_.space().difference(to, from);
  }
  double distance(const Point& to, const Point& from) const noexcept { return difference(to, from).norm(); }
  const Point& goal() const noexcept { return goal_; }
  const Point& target() const noexcept { return guard_.target(); }
  const Eigen::Vector3d& asked() const noexcept { return asked_; }

 private:
  /// Target after this period, before the guard.
  Point wanted(const CrtkVerb& verb) noexcept {
    const auto& space = guard_.space();
    if (verb.level == CrtkLevel::kServo)
      return verb.kind == CrtkKind::kVelocity ? space.moved(target(), period_ * asked_) : goal_;
    const Eigen::Vector3d every = Eigen::Vector3d::Constant(acceleration_);
    if (verb.kind == CrtkKind::kVelocity) {
      speed_ = rampedVelocity(asked_, speed_, every, period_);
    } else {
      const Eigen::Vector3d displacement = difference(goal_, target());
      const double length = displacement.norm();
      Eigen::Vector3d share = Eigen::Vector3d::Zero();
      if (length > 0.0)
        share = displacement.cwiseAbs() / length;
      const Eigen::Vector3d acceleration = acceleration_ * share.cwiseMax(0.1);
      speed_ = smoothVelocity(displacement, speed_, Eigen::Vector3d(max_speed_ * share), acceleration, period_);
    }
    return space.moved(target(), period_ * speed_);
  }

  Guard guard_;
  double max_speed_, leash_, acceleration_, period_;
  Point goal_ = Guard::Space::origin();
  Eigen::Vector3d asked_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d speed_ = Eigen::Vector3d::Zero();  ///< of the target, per second
  double nearest_ = 0.0;                             ///< smallest distance to the goal so far
};

/** Position of a tip or relative position, and of tips the orientation, unless the deployment ignores it. Nothing after
 * construction allocates or throws. */
class CartesianMotion {
 public:
  CartesianMotion(const ControlSetup& setup, bool pair);

  /// The orientation is followed.
  bool rotates() const noexcept { return rotates_; }
  /// Number of its tasks; a relative position needs one of the first tip.
  int tasks() const noexcept { return pair_ || rotates_ ? 2 : 1; }

  /// Goal of a command, absolute; of cr from the target, or from the present place if it is not moving.
  kinematics::TaskPlace goalOf(const CrtkRequest& request, const kinematics::TaskPlace& setpoint) const noexcept;
  /// Whether a command may be followed. @return false with the reason
  bool admits(const CrtkRequest& request, const kinematics::TaskPlace& setpoint, CrtkOutcome& outcome) const noexcept;
  void start(const kinematics::TaskPlace& now) noexcept;
  void take(const CrtkRequest& request, const kinematics::TaskPlace& setpoint, std::int64_t now) noexcept;
  /// Moves the targets by one period.
  void advance(const CrtkVerb& verb,
               const kinematics::TaskPlace& now,
               const planning::teleoperation::DrivenTips& tips) noexcept;

  /// Notes progress toward the goal. @return whether it is reached
  bool reached(const kinematics::TaskPlace& place, std::int64_t now) noexcept;
  /// Time of the last progress, ns.
  std::int64_t nearerAt() const noexcept { return nearer_at_; }

  kinematics::TaskPlace target() const noexcept { return {position_.target(), orientation_.target()}; }
  /// Task of a position. @param gain  of control, 1/s: feed-forward adds what it lacks to the response time
  planning::TaskReference taskTo(planning::TaskKind kind,
                                 int arm,
                                 const Eigen::Vector3d& target,
                                 const Eigen::Vector3d& now,
                                 double gain) const noexcept;
  /// Task of the orientation of an arm's tip.
  planning::TaskReference orientationTask(int arm, const Eigen::Quaterniond& now, double gain) const noexcept;
  /// Writes the goal of interpolate and move.
  void fill(const CrtkVerb& verb, std::size_t group, CrtkSnapshot& snapshot) const noexcept;

 private:
  const planning::teleoperation::RotationOptions& rotation_;
  config::Crtk options_;
  double response_;
  bool pair_, rotates_;
  CartesianTrack<planning::teleoperation::TipRegions> position_;
  CartesianTrack<planning::teleoperation::FreeOrientations> orientation_;
  std::int64_t nearer_at_ = 0;
};

}  // namespace tandem::operation
