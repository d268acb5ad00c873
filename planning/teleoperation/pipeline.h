// SPDX-License-Identifier: Apache-2.0
/** @file Teleoperation pipeline: from device input to control tasks. */
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string_view>

#include "idl/enumerations.h"
#include "planning/reference.h"
#include "planning/teleoperation/one_euro.h"
#include "planning/teleoperation/target_guard.h"

namespace tandem::planning::teleoperation {

using Device = idl::TeleopDevice;
using idl::name;

using Mode = idl::TeleopMode;
using State = idl::TeleopState;

/** The stages in their order. Up to the scale they handle velocities of the device, m/s; from then on places of what is
 * driven, m, robot base frame. */
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

inline constexpr double kMinScale = 0.05, kMaxScale = 1.0;

/** How devices become motion. */
struct Options {
  double scale = 0.5;              ///< of the motion, unless the operator asks for another one
  double scale_rate = 0.5;         ///< at which it changes, 1/s
  double deadband_speed = 0.5e-3;  ///< of devices that say velocities, m/s
  double deadband_distance = 0.0;  ///< of devices that say places, m: their play
  OneEuroOptions filter;
  GuardOptions guard;
};

/** What a device says. */
struct Sample {
  std::uint64_t number = 0;  ///< another one than before: it has been read again
  bool present = false;      ///< the dead-man switch is held
  bool clutch = false;
  Mode mode = Mode::kNone;
  int arm = 0;
  int other_arm = 0;  ///< equal to arm: no other one
  bool pose = false;  ///< `value` is a place, m, otherwise a velocity, m/s
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Quaterniond frame = Eigen::Quaterniond::Identity();  ///< from the device's axes to those of the base frame
  double scale = 0.0;                                         ///< 0: that of the options
};

/** Where the tips are, m, robot base frame. */
using TipPlaces = std::array<Eigen::Vector3d, safety::kMaxArms>;

/** One operator's way to the robot. Engaging starts from where the robot is, and only motion of the device from then on
 * counts: nothing jumps. Nothing after construction allocates or throws; all lengths are m. */
class Pipeline {
 public:
  /// @param options  must outlive this; @param period  of control, s
  Pipeline(const Options& options, double period);

  /// One control cycle with the last sample, and where the tips are now. Follows while the sample's dead-man switch is
  /// held. @return State::kReleased, kClutched or kFollowing.
  State step(const Sample& sample, const TipPlaces& tips) noexcept;
  /// Ends following, from outside.
  void release() noexcept;

  bool engaged() const noexcept { return engaged_; }
  State state() const noexcept { return state_; }
  const std::array<StageResult, kStages>& stages() const noexcept { return stages_; }
  double scale() const noexcept { return scale_; }
  const Eigen::Vector3d& wanted() const noexcept { return wanted_; }
  const Eigen::Vector3d& target() const noexcept { return guard_.target(); }
  /// Where what is driven is.
  const Eigen::Vector3d& position() const noexcept { return now_; }
  /// How long ago the target was where the tip is, by the speed of the target, s; 0 where that stands.
  double lag() const noexcept;

  /// Tasks while engaged. @param gains  of control, 1/s, for kRelativePosition and kTipPosition: feed-forward makes up
  /// for what they lack to the response time
  void tasks(double relative_gain, double tip_gain, Reference& reference) const noexcept;

 private:
  void engage(const Sample& sample, const TipPlaces& tips) noexcept;
  Eigen::Vector3d deviceVelocity(const Sample& sample) noexcept;
  DrivenTips drivenTips(const TipPlaces& tips) const noexcept;
  void pass(Stage stage, const Eigen::Vector3d& in, const Eigen::Vector3d& out, Limiter limiter) noexcept;

  const Options* options_;
  double period_, response_, leash_;
  OneEuro filter_;
  TargetGuard guard_;
  State state_ = State::kReleased;
  bool engaged_ = false;
  Mode mode_ = Mode::kNone;
  int arm_ = 0, other_arm_ = 0;
  double scale_;
  double target_speed_ = 0.0;  ///< m/s
  std::uint64_t number_ = 0;
  bool placed_ = false;                                   ///< last_place_ is one of this engagement
  Eigen::Vector3d last_place_ = Eigen::Vector3d::Zero();  ///< of the device, behind its play
  Eigen::Vector3d raw_ = Eigen::Vector3d::Zero();         ///< what the device's motion adds up to
  Eigen::Vector3d wanted_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d now_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d held_ = Eigen::Vector3d::Zero();  ///< relative position, or the other tip's place, since engaging
  std::array<StageResult, kStages> stages_{};
};

}  // namespace tandem::planning::teleoperation
