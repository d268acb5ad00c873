// SPDX-License-Identifier: Apache-2.0
/** @file Limits on targets of tips: bounds, speed, and largest distance ahead of the tip. */
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "planning/teleoperation/spaces.h"

namespace tandem::planning::teleoperation {

/** Limiter that changed the input of a stage. */
enum class Limiter : std::uint8_t {
  kNone = 0,
  kForbiddenRegion,  ///< region in StageResult::index
  kGuidance,
  kWorkspace,  ///< index: 0 to 5 for x_min, x_max, y_min, y_max, z_min, z_max
  kSpeed,
  kLeash,
  kDeadband,
  kDeadMan,
  kClutch,
  kScale,
};

/** Result of one stage in one cycle. */
struct StageResult {
  Eigen::Vector3d input = Eigen::Vector3d::Zero();
  Eigen::Vector3d output = Eigen::Vector3d::Zero();
  Limiter limiter = Limiter::kNone;
  int index = 0;
};

/** Results of the stages of a guard. */
struct GuardResult {
  StageResult fixture, workspace, rate, reach;
};

/** Moves a target from its present to its wanted place as far as its bounds, its speed and its leash allow. Nothing
 * after construction allocates or throws.
 * @tparam Bounds  TipRegions or FreeOrientations: the space, the body that moves with the target, the largest speed,
 * where the target may go */
template <class Bounds>
class TargetGuard {
 public:
  using Space = typename Bounds::Space;
  using Point = typename Space::Point;
  using Body = typename Bounds::Body;

  explicit TargetGuard(const Bounds& bounds) : bounds_(bounds) {}

  /// Sets the target to the present place, robot base frame.
  void engage(const Point& x) noexcept { target_ = x; }

  /// @param now  the present place; @param leash  largest distance between target and now, m or rad
  const GuardResult& step(const Point& wanted, const Point& now, const Body& body, double leash, double dt) noexcept {
    const Space& space = bounds_.space();
    result_ = {};
    Point x = bounds_.confined(wanted, target_, body, result_);
    result_.rate.input = space.shown(x, now);
    const Eigen::Vector3d step = space.difference(x, target_);
    if (const double length = step.norm(), most = bounds_.maxSpeed() * dt; length > most) {
      x = space.moved(target_, (most / length) * step);
      result_.rate.limiter = Limiter::kSpeed;
    }
    result_.rate.output = result_.reach.input = space.shown(x, now);
    const Eigen::Vector3d ahead = space.difference(x, now);
    if (const double length = ahead.norm(); length > leash) {
      x = space.moved(now, (leash / length) * ahead);
      result_.reach.limiter = Limiter::kLeash;
    }
    target_ = bounds_.clear(x, target_, now, body, result_);
    result_.reach.output = space.shown(target_, now);
    return result_;
  }

  const Point& target() const noexcept { return target_; }
  const Space& space() const noexcept { return bounds_.space(); }

 private:
  Bounds bounds_;
  Point target_ = Space::origin();
  GuardResult result_;
};

/** Bounds of a tip's orientation: none but its speed. */
class FreeOrientations {
 public:
  using Space = Orientations;
  struct Body {};

  /// @param max_speed  rad/s
  FreeOrientations(const Orientations& space, double max_speed) : space_(space), max_speed_(max_speed) {}

  const Orientations& space() const noexcept { return space_; }
  double maxSpeed() const noexcept { return max_speed_; }
  const Eigen::Quaterniond& confined(const Eigen::Quaterniond& wanted,
                                     const Eigen::Quaterniond&,
                                     const Body&,
                                     GuardResult&) const noexcept {
    return wanted;
  }
  const Eigen::Quaterniond& clear(const Eigen::Quaterniond& x,
                                  const Eigen::Quaterniond&,
                                  const Eigen::Quaterniond&,
                                  const Body&,
                                  GuardResult&) const noexcept {
    return x;
  }

 private:
  Orientations space_;
  double max_speed_;
};

using OrientationGuard = TargetGuard<FreeOrientations>;

}  // namespace tandem::planning::teleoperation
