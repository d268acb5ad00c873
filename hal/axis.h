// SPDX-License-Identifier: Apache-2.0
/** @file One axis: guards, brake, reference and targets, above the driver of its drive and absolute encoder. */
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/axis_driver.h"
#include "hal/brake.h"
#include "hal/feedback.h"
#include "hal/fieldbus.h"
#include "hal/first_motion.h"
#include "hal/guards.h"
#include "hal/hardware.h"
#include "hal/limit_switches.h"
#include "hal/measured_motion.h"
#include "hal/position_memory.h"
#include "hal/run_motion.h"
#include "hal/torque_guard.h"
#include "hal/torque_release.h"
#include "idl/enumerations.h"

namespace tandem::hal {

using idl::AxisPhase;
using idl::name;

/** Reply to a joint position that a person has measured. */
enum class MeasurementAnswer : std::uint8_t {
  kTaken,           ///< the axis is ready once its drive has its software limits
  kNotDisabled,     ///< the arm has power, or is not DISABLED
  kNotUp,           ///< drive or encoder are not up
  kGuarded,         ///< a guard is active
  kMoves,           ///< the joint moves
  kOtherReference,  ///< the reference of the axis is not PositionReference::kMeasured
  kOutside,         ///< farther outside the limits than they are apart
};

/** Drive and encoder of one joint. Nothing after construction allocates, locks or throws. Times are ns on the caller's
 * clock. */
class Axis {
 public:
  /** Adds the drive and encoder to the bus, which must outlive the axis.
   * @throw std::invalid_argument as Fieldbus::addAxis() does. */
  Axis(const HardwareConfig& hardware, const AxisConfig& config, Fieldbus& bus, const safety::Budgets& budgets);

  /// Resets and configures the devices; clears all guards of the axis.
  void boot(std::int64_t now) noexcept;

  /// Processes what the bus has received: once per period, after Fieldbus::receive().
  void update(std::int64_t now) noexcept;

  /// Sets the power goal of the drive; kOperation only while phase() is kReady (or in a homing run).
  void setGoal(PowerGoal goal, std::int64_t now) noexcept { power_.setGoal(goal, now); }
  /// Sets the target position, m or rad, and the velocity towards it, m/s or rad/s.
  void setTarget(double position, double velocity) noexcept;
  /// The target follows the joint while the drive has no torque, and stays constant as soon as it has.
  void hold() noexcept { holding_ = true; }
  /// Commands the drive, before Fieldbus::transmit().
  void writeCommand(std::int64_t now) noexcept;

  AxisPhase phase() const noexcept { return phase_; }
  /// Active guards. Guards that only apply in operation count while `operating`.
  GuardMask guards() const noexcept { return guards_; }
  /// Fault that follows from these guards, with its cause.
  safety::FaultRecord failure(GuardMask guards) const noexcept;
  /// The HAL moves or holds the joint: the guards of operation count from now on.
  void setOperating(bool operating) noexcept;
  /// Sets a guard that the owner of the axis has detected; it stays until the next boot.
  void fail(HardwareGuard guard) noexcept;
  /// fail(HardwareGuard::kHoming) with its first reason.
  void failHoming(HomingFailure reason) noexcept;
  HomingFailure homingFailure() const noexcept { return homing_failure_; }

  DriveState driveState() const noexcept { return power_.state(); }
  PowerGoal goal() const noexcept { return power_.goal(); }
  bool goalReached() const noexcept { return power_.reached(); }
  bool goalLate(std::int64_t now) const noexcept { return power_.late(now); }
  /// The drive is in operation, its brake is open, and it reports that it follows the target.
  bool followsCommand() const noexcept;
  /// The drive has failed or is silent: its last measurement is not valid any more.
  bool unresponsive() const noexcept {
    return phase_ == AxisPhase::kFailed || (guards_ & bit(HardwareGuard::kDriveSilent)) != 0;
  }
  /// The first motion after the boot is over, and was as commanded (FirstMotion).
  bool firstMotionConfirmed() const noexcept { return first_motion_.confirmed(); }
  /// Standstill by measurement.
  bool atStandstill() const noexcept { return motion_.atStandstill(); }
  /// The HAL moves or holds the joint.
  bool operating() const noexcept { return operating_; }

  bool referenced() const noexcept { return phase_ == AxisPhase::kReady; }
  /// The devices run, and the HAL has done what it can for the reference.
  bool up() const noexcept {
    return phase_ == AxisPhase::kReady || phase_ == AxisPhase::kUnhomed || unconfirmed() || unmeasured();
  }
  /// The axis has a position, which is not plausible: somebody has to confirm it.
  bool unconfirmed() const noexcept { return phase_ == AxisPhase::kUnconfirmed; }
  /// Somebody has to measure the position of the joint.
  bool unmeasured() const noexcept { return phase_ == AxisPhase::kUnmeasured; }
  /// Referenced; drive and encoder respond and agree.
  bool valid() const noexcept;
  double position() const noexcept { return position_; }           ///< from the drive, m or rad; 0 before the reference
  double velocity() const noexcept { return motion_.velocity(); }  ///< measured, m/s or rad/s
  double target() const noexcept { return target_; }               ///< m or rad
  double torque() const noexcept { return drive_.torque; }         ///< or current, share of the rated one
  LimitSwitch limitSwitch() const noexcept { return switches_.active(); }  ///< at the last sample
  double encoderPosition() const noexcept { return encoder_sample_.position; }
  double followingError() const noexcept { return following_.error(); }  ///< m or rad
  /// Share of the last 100 samples that were received, 0 to 1: the lower one of drive and encoder.
  double feedbackSuccess() const noexcept;
  const AxisConfig& config() const noexcept { return config_; }
  /// AxisConfig::travelWithoutHal() of this drive.
  double travelWithoutHal(ProtectionMask lost) const noexcept {
    return config_.travelWithoutHal(lost, heartbeat_budget_);
  }
  /// Protections without which the drive is not used, and which it lacks at boot: one of leastProtections(), or 0.
  ProtectionMask missingProtections() const noexcept { return missing_; }
  AxisDriver& driver() noexcept { return driver_; }
  const AxisDriver& driver() const noexcept { return driver_; }

  /// The drive is in operation, and shows that it does the task that it was prepared for.
  bool operates() const noexcept { return goalReached() && confirmed(); }
  /// Software limits of the drive: widened to contain the present position, or as configured. Only without torque.
  void setRecovering(bool recovering) noexcept;
  /// The drive's software limits are being written.
  bool settingLimits() const noexcept { return limits_pending_; }
  /// Assigns this position of the joint to a position from the drive's own zero, and writes the software limits again.
  /// Only without torque.
  void rereference(double place, double position) noexcept;
  /// The joint stands at this position, m or rad, as measured from outside; only without torque. A later measurement
  /// replaces it.
  MeasurementAnswer takeMeasurement(double position) noexcept;
  /// Position from the drive's own zero at this position of the joint, m or rad.
  double placeOf(double position) const noexcept { return position - zero_; }
  /// A homing run begins: until endRun(), its travel is watched (RunMotion). @param slowest,fastest  its velocities,
  /// m/s or rad/s
  void beginRun(double slowest, double fastest, std::int64_t now) noexcept {
    run_motion_.begin(slowest, fastest, drive_.position, now);
  }
  void endRun() noexcept { run_motion_.end(); }
  /// Until the next reference, positions and targets count from here: for a run against a mechanical stop.
  void countFromHere() noexcept;
  /// Position that was last known to be right; to be restored before boot().
  PositionMemory& memory() noexcept { return memory_; }
  const PositionMemory& memory() const noexcept { return memory_; }
  /// Somebody confirms the position of an axis that is unconfirmed().
  void confirm() noexcept;

 private:
  void updatePhase(std::int64_t now) noexcept;
  void readDrive(std::int64_t now) noexcept;
  void readEncoder(std::int64_t now) noexcept;
  void reference() noexcept;
  void setLimits() noexcept;
  void finishLimits() noexcept;
  void beReady() noexcept;
  void moveBrake(std::int64_t now) noexcept;
  bool mayRelease(std::int64_t now) noexcept;
  double targetVelocity() const noexcept;
  void judge(std::int64_t now) noexcept;
  void judgeMotion(std::int64_t now) noexcept;
  /// Position with which the drive's is compared: that of the encoder; without one, the drive's own.
  double comparedPosition() const noexcept { return config_.encoder ? encoderPosition() : position_; }
  /// Position of the joint at the last sample, as far as the axis has a reference.
  double measured() const noexcept { return zero_ + drive_.position; }
  bool confirmed() const noexcept { return driver_.confirmed() == Progress::kDone; }
  void noteGuard(HardwareGuard guard, bool stands) noexcept { guards_ |= stands ? bit(guard) : 0; }

  AxisConfig config_;
  double heartbeat_budget_;  ///< time-out of the drive for the HAL's heartbeat, s
  FeedbackBudget feedback_budget_;
  const Fieldbus& bus_;
  AxisDriver& driver_;
  std::vector<ProtectionMask> least_;  ///< leastProtections()
  ProtectionMask missing_ = 0;
  double zero_;  ///< position of the joint at the drive's own zero, m or rad
  PowerSequence power_;
  MeasuredMotion motion_;
  std::optional<Brake> brake_;
  TorqueGuard torque_;
  FirstMotion first_motion_;
  RunMotion run_motion_;
  LimitSwitches switches_;
  TorqueRelease release_;
  PositionMemory memory_;
  AxisPhase phase_ = AxisPhase::kBooting;
  GuardMask guards_ = 0;
  GuardMask latched_ = 0;  ///< set by fail(), until the next boot
  HomingFailure homing_failure_ = HomingFailure::kNone;
  bool operating_ = false;
  bool free_to_move_ = true;  ///< there is no brake, or it is open
  bool closing_ = false;      ///< the brake closes, or is closed, before torque goes off
  bool holding_ = true;
  bool fault_reset_ = false;     ///< send one fault reset if the drive shows a fault after its boot
  bool limits_pending_ = false;  ///< software limits are being written
  bool recovering_ = false;      ///< the software limits are widened for a joint outside them

  FeedbackStream drive_stream_;
  FeedbackStream encoder_stream_;
  FollowingWatch following_;
  DriveFeedback drive_;             ///< last sample that counts
  EncoderFeedback encoder_sample_;  ///< likewise
  bool provisional_ = false;        ///< the position counts from the start of a run against a mechanical stop
  double position_ = 0.0;
  double target_ = 0.0;
  double target_velocity_ = 0.0;
  double target_place_ = 0.0;  ///< target from the drive's own zero, m or rad
};

}  // namespace tandem::hal
