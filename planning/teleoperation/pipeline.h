// SPDX-License-Identifier: Apache-2.0
/** @file Teleoperation pipeline: from device input to control tasks. */
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "idl/enumerations.h"
#include "planning/reference.h"
#include "planning/teleoperation/channel.h"
#include "planning/teleoperation/tip_regions.h"

namespace tandem::planning::teleoperation {

using Device = idl::TeleopDevice;
using idl::name;

using Mode = idl::TeleopMode;
using State = idl::TeleopState;

inline constexpr double kMinScale = 0.05, kMaxScale = 1.0;

/** Parameters of rotations. */
struct RotationOptions {
  TipOrientation followed = TipOrientation::kIgnored;
  double scale = 1.0;            ///< of the device's rotation
  double deadband_speed = 0.02;  ///< of devices that send velocities, rad/s
  double deadband_angle = 0.0;   ///< of devices that send orientations, rad
  double filter_beta = 4.0;      ///< OneEuroOptions::beta, 1/rad; the cutoffs are those of positions
  double max_speed = 0.5;        ///< of targets, rad/s
  double leash = 0.1;            ///< largest angle between target and tip, rad

  Orientations space() const noexcept { return {followed == TipOrientation::kAxis}; }
};

/** Parameters of the pipeline. */
struct Options {
  double scale = 0.5;              ///< of the motion, unless the operator selects another one
  double scale_rate = 0.5;         ///< rate of its change, 1/s
  double deadband_speed = 0.5e-3;  ///< of devices that send velocities, m/s
  double deadband_distance = 0.0;  ///< of devices that send positions, m: their backlash
  OneEuroOptions filter;
  GuardOptions guard;
  RotationOptions rotation;
};

/// Guard of orientations with these options.
inline OrientationGuard orientationGuard(const RotationOptions& options) noexcept {
  return OrientationGuard(FreeOrientations(options.space(), options.max_speed));
}
/// Leash of orientations at a control period, rad.
inline double angleLeashOf(const Options& options, double period) noexcept {
  return leashOf(options.rotation.leash, options.rotation.max_speed, responseTime(options.guard, period));
}

/** Input sample of a device. */
struct Sample {
  std::uint64_t number = 0;  ///< changes with each new reading
  bool present = false;      ///< the dead-man switch is pressed
  bool clutch = false;
  Mode mode = Mode::kNone;
  int arm = 0;
  int other_arm = 0;  ///< equal to arm: none
  bool pose = false;  ///< `value` is a position, m, and `orientation` counts; otherwise a velocity, m/s, and `angular`
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();                ///< rad/s
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< unit
  Eigen::Quaterniond frame = Eigen::Quaterniond::Identity();        ///< base frame axes <- device axes
  double scale = 0.0;                                               ///< 0: that of the options
};

/** Poses of the tips, m, robot base frame. */
using TipPlaces = std::array<kinematics::TaskPlace, safety::kMaxArms>;

/** Pipeline of one operator. Engaging starts at the robot's present position, and only device motion after that counts:
 * there is no jump. Positions and, unless RotationOptions::followed is kIgnored, the orientation of the driven arm's
 * tip pass the same stages. Nothing after construction allocates or throws; all lengths are m. */
class Pipeline {
 public:
  /// @param options  must outlive this; @param period  of control, s
  Pipeline(const Options& options, double period);

  /// One control cycle with the last sample and the present tips. Follows while the sample's dead-man switch is
  /// pressed. @return State::kReleased, kClutched or kFollowing.
  State step(const Sample& sample, const TipPlaces& tips) noexcept;
  /// Ends following by an external request.
  void release() noexcept;

  bool engaged() const noexcept { return engaged_; }
  State state() const noexcept { return state_; }
  const StageResults& stages() const noexcept { return position_.stages(); }
  /// Of the rotations; without meaning if they are ignored.
  const StageResults& rotationStages() const noexcept { return orientation_.stages(); }
  bool rotates() const noexcept { return options_->rotation.followed != TipOrientation::kIgnored; }
  double scale() const noexcept { return scale_; }
  const Eigen::Vector3d& wanted() const noexcept { return position_.wanted(); }
  const Eigen::Vector3d& target() const noexcept { return position_.target(); }
  const Eigen::Quaterniond& targetOrientation() const noexcept { return orientation_.target(); }
  /// Present position of the driven point.
  const Eigen::Vector3d& position() const noexcept { return position_.now(); }
  /// Time by which the tip lags behind the target at the target's speed, s; 0 if the target is at standstill.
  double lag() const noexcept;

  /// Tasks while engaged: positions, then the orientation. @param gains  of control, 1/s, for kRelativePosition and
  /// kTipPosition: feed-forward adds what they lack to the response time
  void tasks(double relative_gain, double tip_gain, Reference& reference) const noexcept;

 private:
  void engage(const Sample& sample, const TipPlaces& tips) noexcept;
  void read(const Sample& sample) noexcept;
  Eigen::Vector3d driven(const TipPlaces& tips) const noexcept;
  DrivenTips drivenTips(const TipPlaces& tips) const noexcept;

  const Options* options_;
  double period_, response_;
  Channel<TipRegions> position_;
  Channel<FreeOrientations> orientation_;
  State state_ = State::kReleased;
  bool engaged_ = false;
  Mode mode_ = Mode::kNone;
  int arm_ = 0, other_arm_ = 0;
  double scale_;
  std::uint64_t number_ = 0;
  Eigen::Vector3d held_ = Eigen::Vector3d::Zero();  ///< relative position, or the other tip's position, since engaging
};

}  // namespace tandem::planning::teleoperation
