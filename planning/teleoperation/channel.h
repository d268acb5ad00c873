// SPDX-License-Identifier: Apache-2.0
/** @file One channel of the teleoperation pipeline: from the device's motion to a target, of positions or orientations.
 */
#pragma once

#include <array>
#include <string_view>

#include "planning/teleoperation/one_euro.h"
#include "planning/teleoperation/target_guard.h"

namespace tandem::planning::teleoperation {

/** The stages in their order. Stages up to the scale process velocities of the device, m/s or rad/s; the later ones
 * places of what is driven (a tip or a relative position, m, robot base frame; or a tip's orientation, as rotation
 * vector from its present one, rad, robot base frame). Fixture and workspace are of positions only. */
enum class Stage : std::uint8_t {
  kDeadband,
  kDeadMan,
  kClutch,
  kFrame,
  kScale,
  kFilter,
  kFixture,
  kWorkspace,
  kRate,
  kReach,
};
inline constexpr int kStages = 10;
std::string_view name(Stage stage);
using StageResults = std::array<StageResult, kStages>;

/** Parameters of a channel. */
struct ChannelOptions {
  double deadband_speed = 0.0;     ///< of devices that send velocities, m/s or rad/s
  double deadband_distance = 0.0;  ///< of devices that send places, m or rad: their backlash
  OneEuroOptions filter;
  double leash = 0.0;  ///< largest distance of the target ahead of what is driven, m or rad
};

/** Input of a channel in one cycle. */
template <class Space>
struct ChannelInput {
  bool fresh = false;    ///< a new reading
  bool present = false;  ///< the dead-man switch is pressed
  bool clutch = false;
  bool places = false;  ///< the device sends places, otherwise velocities
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  typename Space::Point place = Space::origin();
  Eigen::Quaterniond frame = Eigen::Quaterniond::Identity();  ///< base frame axes <- device axes
  double scale = 1.0;
};

/** Only motion of the device after engage() counts. Nothing after construction allocates or throws. */
template <class Bounds>
class Channel {
 public:
  using Guard = TargetGuard<Bounds>;
  using Space = typename Guard::Space;
  using Point = typename Guard::Point;

  /// @param period  of control, s
  Channel(const ChannelOptions& options, const Bounds& bounds, double period)
      : options_(options), period_(period), filter_(options.filter, bounds.space()), guard_(bounds) {}

  /// Starts at the present place.
  void engage(const Point& now) noexcept {
    placed_ = false;
    raw_ = now_ = now;
    filter_.reset(now);
    guard_.engage(now);
    target_speed_ = 0.0;
  }

  /// Stages up to the scale, engaged or not; the others are cleared.
  void read(const ChannelInput<Space>& input) noexcept {
    stages_ = {};
    clutch_ = input.clutch;
    places_ = input.places;
    const Eigen::Vector3d read = deviceVelocity(input);
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    const Eigen::Vector3d allowed = input.present ? read : none;
    pass(Stage::kDeadMan, read, allowed, Limiter::kDeadMan);
    const Eigen::Vector3d free = input.clutch ? none : allowed;
    pass(Stage::kClutch, allowed, free, Limiter::kClutch);
    const Eigen::Vector3d turned = input.frame * free;
    pass(Stage::kFrame, free, turned, Limiter::kNone);
    scaled_ = input.scale * turned;
    pass(Stage::kScale, turned, scaled_, Limiter::kScale);
  }

  /// Stages from the filter on. @param now  present place of what is driven
  void follow(const Point& now, const typename Bounds::Body& body) noexcept {
    const Space& space = guard_.space();
    now_ = now;
    move();
    wanted_ = filter_.step(raw_, period_);
    pass(Stage::kFilter, space.shown(raw_, now), space.shown(wanted_, now), Limiter::kNone);
    const Point before = guard_.target();
    const GuardResult& result = guard_.step(wanted_, now, body, options_.leash, period_);
    target_speed_ = space.difference(guard_.target(), before).norm() / period_;
    at(Stage::kFixture) = result.fixture;
    at(Stage::kWorkspace) = result.workspace;
    at(Stage::kRate) = result.rate;
    at(Stage::kReach) = result.reach;
    // A device that sends velocities has no place: motion that was not allowed is discarded, so that reverse motion
    // starts at once. A device that sends places keeps its place behind the bound.
    if (!places_) {
      const Eigen::Vector3d back = space.difference(guard_.target(), wanted_);
      raw_ = space.moved(raw_, back);
      filter_.shift(back);
    }
  }

  const StageResults& stages() const noexcept { return stages_; }
  const Point& wanted() const noexcept { return wanted_; }
  const Point& target() const noexcept { return guard_.target(); }
  /// Present place of what is driven.
  const Point& now() const noexcept { return now_; }
  /// From the present place to the target, m or rad.
  Eigen::Vector3d ahead() const noexcept { return guard_.space().difference(guard_.target(), now_); }
  /// Of the target, m/s or rad/s.
  double targetSpeed() const noexcept { return target_speed_; }

 private:
  StageResult& at(Stage stage) noexcept { return stages_[static_cast<std::size_t>(stage)]; }

  void pass(Stage stage, const Eigen::Vector3d& in, const Eigen::Vector3d& out, Limiter limiter) noexcept {
    at(stage) = {in, out, in == out ? Limiter::kNone : limiter, 0};
  }

  /// Part of a vector outside of a ball.
  static Eigen::Vector3d outside(const Eigen::Vector3d& v, double radius) noexcept {
    const double norm = v.norm();
    return norm <= radius ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d((1.0 - radius / norm) * v);
  }

  /// Device velocity over this cycle. For places: motion since the last one; the first one only sets the origin.
  Eigen::Vector3d deviceVelocity(const ChannelInput<Space>& input) noexcept {
    if (!input.places) {
      placed_ = false;
      const Eigen::Vector3d v = outside(input.velocity, options_.deadband_speed);
      pass(Stage::kDeadband, input.velocity, v, Limiter::kDeadband);
      return v;
    }
    constexpr Space kDevice{};  // all of its motion, whatever part of it the tip follows
    Eigen::Vector3d moved = Eigen::Vector3d::Zero(), all = Eigen::Vector3d::Zero();
    if (input.fresh && placed_) {
      all = kDevice.difference(input.place, last_place_);
      moved = outside(all, options_.deadband_distance);
      last_place_ = kDevice.moved(last_place_, moved);
    } else if (input.fresh) {
      last_place_ = input.place;
      placed_ = true;
    }
    pass(Stage::kDeadband, all / period_, moved / period_, Limiter::kDeadband);
    return moved / period_;
  }

  /// Sums the motion up; with the clutch, motion still in the filter is discarded.
  void move() noexcept {
    const Space& space = guard_.space();
    if (clutch_) {
      raw_ = guard_.target();
      filter_.reset(raw_);
      return;
    }
    raw_ = space.moved(raw_, shortened(period_ * scaled_, 0.5 * Space::kFarthest));
    const Eigen::Vector3d ahead = space.difference(raw_, guard_.target());
    if (ahead.norm() > Space::kFarthest)
      raw_ = space.moved(guard_.target(), shortened(ahead, Space::kFarthest));
  }

  ChannelOptions options_;
  double period_;
  OneEuro<Space> filter_;
  Guard guard_;
  bool clutch_ = false, places_ = false;
  bool placed_ = false;                 ///< last_place_ belongs to this engagement
  Point last_place_ = Space::origin();  ///< of the device, after its deadband
  Eigen::Vector3d scaled_ = Eigen::Vector3d::Zero();
  Point raw_ = Space::origin();  ///< sum of the device's motion
  Point wanted_ = Space::origin();
  Point now_ = Space::origin();
  double target_speed_ = 0.0;
  StageResults stages_{};
};

}  // namespace tandem::planning::teleoperation
