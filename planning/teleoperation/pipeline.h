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

/** The stages in their order. Stages up to the scale process velocities of the device, m/s; the later ones positions of
 * the driven point (a tip or a relative position), m, robot base frame. */
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

/** Parameters of the pipeline. */
struct Options {
  double scale = 0.5;              ///< of the motion, unless the operator selects another one
  double scale_rate = 0.5;         ///< rate of its change, 1/s
  double deadband_speed = 0.5e-3;  ///< of devices that send velocities, m/s
  double deadband_distance = 0.0;  ///< of devices that send positions, m: their backlash
  OneEuroOptions filter;
  GuardOptions guard;
};

/** Input sample of a device. */
struct Sample {
  std::uint64_t number = 0;  ///< changes with each new reading
  bool present = false;      ///< the dead-man switch is pressed
  bool clutch = false;
  Mode mode = Mode::kNone;
  int arm = 0;
  int other_arm = 0;  ///< equal to arm: none
  bool pose = false;  ///< `value` is a position, m; otherwise a velocity, m/s
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Quaterniond frame = Eigen::Quaterniond::Identity();  ///< base frame axes <- device axes
  double scale = 0.0;                                         ///< 0: that of the options
};

/** Positions of the tips, m, robot base frame. */
using TipPlaces = std::array<Eigen::Vector3d, safety::kMaxArms>;

/** Pipeline of one operator. Engaging starts at the robot's present position, and only device motion after that counts:
 * there is no jump. Nothing after construction allocates or throws; all lengths are m. */
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
  const std::array<StageResult, kStages>& stages() const noexcept { return stages_; }
  double scale() const noexcept { return scale_; }
  const Eigen::Vector3d& wanted() const noexcept { return wanted_; }
  const Eigen::Vector3d& target() const noexcept { return guard_.target(); }
  /// Present position of the driven point.
  const Eigen::Vector3d& position() const noexcept { return now_; }
  /// Time by which the tip lags behind the target at the target's speed, s; 0 if the target is at standstill.
  double lag() const noexcept;

  /// Tasks while engaged. @param gains  of control, 1/s, for kRelativePosition and kTipPosition: feed-forward adds what
  /// they lack to the response time
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
  bool placed_ = false;                                   ///< last_place_ belongs to this engagement
  Eigen::Vector3d last_place_ = Eigen::Vector3d::Zero();  ///< of the device, after its deadband
  Eigen::Vector3d raw_ = Eigen::Vector3d::Zero();         ///< sum of the device's motion
  Eigen::Vector3d wanted_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d now_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d held_ = Eigen::Vector3d::Zero();  ///< relative position, or the other tip's position, since engaging
  std::array<StageResult, kStages> stages_{};
};

}  // namespace tandem::planning::teleoperation
