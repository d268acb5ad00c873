// SPDX-License-Identifier: Apache-2.0
/** @file One axis: drive, absolute encoder, and the guards on both. */
#pragma once

#include <cstdint>

#include "hal/brake.h"
#include "hal/canopen/network.h"
#include "hal/encoder_reading.h"
#include "hal/feedback.h"
#include "hal/first_motion.h"
#include "hal/guards.h"
#include "hal/hardware.h"
#include "hal/measured_motion.h"
#include "hal/mode_confirmation.h"
#include "hal/position_memory.h"
#include "hal/sdo_jobs.h"
#include "hal/temperature.h"
#include "hal/torque_guard.h"
#include "hal/torque_release.h"
#include "idl/enumerations.h"

namespace tandem::hal {

using idl::AxisPhase;
using idl::name;

/** Drive and encoder of one joint. Reads and writes the PDOs of their nodes; sends nothing by itself. Nothing after
 * construction allocates, locks or throws. Times are ns on the caller's clock. */
class Axis {
 public:
  /** Adds the nodes to the network, which must outlive the axis.
   * @param heartbeat_budget time-out of the nodes for the HAL's heartbeat, s
   * @throw std::invalid_argument as Network::addNode() does. */
  Axis(const HardwareConfig& hardware,
       const AxisConfig& config,
       canopen::Network& network,
       const safety::Budgets& budgets);

  /// Resets and configures the nodes; clears all guards of the axis.
  void boot(std::int64_t now) noexcept;

  /// Processes the frames that the network has received: once per period, after Network::receive().
  void update(std::int64_t now) noexcept;
  void onEmcy(int node, const canopen::Emcy& emcy) noexcept;

  /// Sets the power goal of the drive; kOperation only while phase() is kReady (or in a homing run).
  void setGoal(PowerGoal goal, std::int64_t now) noexcept { power_.setGoal(goal, now); }
  /// Sets the target position, m or rad, and the velocity towards it, m/s or rad/s.
  void setTarget(double position, double velocity) noexcept;
  /// The target follows the joint while the drive has no torque, and stays constant as soon as it has.
  void hold() noexcept { holding_ = true; }
  /// Writes controlword and target into the RPDO, before Network::transmit().
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

  DriveState driveState() const noexcept { return power_.state(); }
  PowerGoal goal() const noexcept { return power_.goal(); }
  bool goalReached() const noexcept { return power_.reached(); }
  bool goalLate(std::int64_t now) const noexcept { return power_.late(now); }
  /// The drive is in operation, its brake is open, and its statusword reports that it follows the target.
  bool followsCommand() const noexcept;
  /// The drive has failed or is silent: its last measurement is not valid any more.
  bool unresponsive() const noexcept {
    return phase_ == AxisPhase::kFailed || (guards_ & bit(HardwareGuard::kDriveSilent)) != 0;
  }
  /// Standstill by measurement.
  bool atStandstill() const noexcept { return motion_.atStandstill(); }
  /// The HAL moves or holds the joint.
  bool operating() const noexcept { return operating_; }
  std::uint16_t statusword() const noexcept { return statusword_; }
  /// Sets the mode-specific bits of the controlword.
  void setModeBits(std::uint16_t bits) noexcept { mode_bits_ = bits; }

  bool referenced() const noexcept { return phase_ == AxisPhase::kReady; }
  /// The nodes run, and the HAL has done what it can for the reference.
  bool up() const noexcept { return phase_ == AxisPhase::kReady || phase_ == AxisPhase::kUnhomed; }
  /// The axis has a position, which is not plausible: somebody has to confirm it.
  bool unconfirmed() const noexcept { return phase_ == AxisPhase::kUnhomed && !config_.needsRun(); }
  /// Referenced; drive and encoder respond and agree.
  bool valid() const noexcept;
  double position() const noexcept { return position_; }           ///< from the drive, m or rad; 0 before the reference
  double velocity() const noexcept { return motion_.velocity(); }  ///< measured, m/s or rad/s
  double target() const noexcept { return target_; }               ///< m or rad
  double torque() const noexcept { return 1e-3 * torque_reading_; }  ///< or current, share of the rated one
  double encoderPosition() const noexcept { return encoder_position_; }
  double followingError() const noexcept { return following_.error(); }  ///< m or rad
  std::uint16_t errorCode() const noexcept { return error_code_; }       ///< of the last emergency message, 0: none
  /// Share of the last 100 TPDOs that were received, 0 to 1: the lower one of drive and encoder.
  double feedbackSuccess() const noexcept;
  /// Drive temperature, degrees Celsius; NaN: not known.
  double temperature() const noexcept { return temperature_.value(); }
  const AxisConfig& config() const noexcept { return config_; }
  /// AxisConfig::travelWithoutHal() of this drive.
  double travelWithoutHal(ProtectionMask lost) const noexcept {
    return config_.travelWithoutHal(lost, heartbeat_budget_);
  }
  const AxisUnits& units() const noexcept { return units_; }
  canopen::Node& driveNode() noexcept { return network_.node(drive_); }
  const canopen::Node& driveNode() const noexcept { return network_.node(drive_); }
  /// Encoder node; nullptr: none.
  const canopen::Node* encoderNode() const noexcept { return encoder_ < 0 ? nullptr : &network_.node(encoder_); }
  int driveIndex() const noexcept { return drive_; }
  int encoderIndex() const noexcept { return encoder_; }

  /// SDO accesses while the axis runs, for homing runs; stepJobs() advances them.
  SdoJobs& jobs() noexcept { return jobs_; }
  /// Requests a mode of operation, only without torque: the drive must show it before the axis follows a command.
  void requestMode(DriveMode mode) noexcept;
  /// The drive is in operation, in the mode that was requested.
  bool operates() const noexcept { return goalReached() && mode_.confirmed(); }
  SdoJobs::Status stepJobs(std::int64_t now) noexcept;
  /// Software limits of the drive: widened to contain the present position, or as configured. Only without torque.
  void setRecovering(bool recovering) noexcept;
  /// The drive's software limits are being written.
  bool settingLimits() const noexcept { return limits_pending_; }
  /// Assigns this position to these counts and writes the software limits again. Only without torque.
  void rereference(std::int32_t counts, double position) noexcept;
  /// Until the next reference, positions and targets count from here: for a run against a mechanical stop.
  void countFromHere() noexcept;
  /// Position that was last known to be right; to be restored before boot().
  PositionMemory& memory() noexcept { return memory_; }
  const PositionMemory& memory() const noexcept { return memory_; }
  /// Somebody confirms the position of an axis that is unconfirmed().
  void confirm() noexcept;

 private:
  void updateNodes(std::int64_t now) noexcept;
  void readDrive(std::int64_t now) noexcept;
  void readEncoder(std::int64_t now) noexcept;
  void reference() noexcept;
  void setLimits() noexcept;
  void finishLimits(std::int64_t now) noexcept;
  void beReady() noexcept;
  void moveBrake(std::int64_t now, bool free) noexcept;
  void stepSdo(std::int64_t now) noexcept;
  bool sdoFree() const noexcept;
  bool mayRelease(std::int64_t now) noexcept;
  void judge(std::int64_t now) noexcept;
  void judgeMotion(std::int64_t now) noexcept;
  /// What the drive's position is compared with: the encoder's, or itself without one.
  double comparedPosition() const noexcept { return encoder_ < 0 ? position_ : encoder_position_; }
  void noteGuard(HardwareGuard guard, bool stands) noexcept { guards_ |= stands ? bit(guard) : 0; }

  AxisConfig config_;
  double heartbeat_budget_;  ///< time-out of the nodes for the HAL's heartbeat, s
  FeedbackBudget feedback_budget_;
  canopen::Network& network_;
  int drive_;
  int encoder_ = -1;
  AxisUnits units_;
  EncoderReading encoder_reading_;
  PowerSequence power_;
  MeasuredMotion motion_;
  std::optional<Brake> brake_;
  TorqueGuard torque_;
  FirstMotion first_motion_;
  TorqueRelease release_;
  PositionMemory memory_;
  SdoJobs jobs_;
  ModeConfirmation mode_;
  Temperature temperature_;
  AxisPhase phase_ = AxisPhase::kBooting;
  GuardMask guards_ = 0;
  GuardMask latched_ = 0;  ///< set by fail(), until the next boot
  bool operating_ = false;
  bool free_to_move_ = true;  ///< there is no brake, or it is open
  bool closing_ = false;      ///< the brake closes, or is closed, before torque goes off
  bool holding_ = true;
  bool fault_reset_ = false;     ///< send one fault reset if the drive shows a fault after its boot
  bool limits_pending_ = false;  ///< software limits are being written
  bool recovering_ = false;      ///< the software limits are widened for a joint outside them

  std::int64_t sampled_ = 0;  ///< time of the last SYNC, ns: sampling time of the TPDOs of this period
  FeedbackStream drive_stream_;
  FeedbackStream encoder_stream_;
  FollowingWatch following_;
  std::uint16_t statusword_ = 0;
  std::int32_t counts_ = 0;
  std::int16_t torque_reading_ = 0;  ///< per mille
  bool provisional_ = false;         ///< the position counts from the start of a run against a mechanical stop
  std::uint16_t mode_bits_ = 0;
  std::uint16_t error_code_ = 0;
  bool emergency_ = false;
  bool encoder_emergency_ = false;
  bool encoder_alarm_ = false;
  double position_ = 0.0;
  double encoder_position_ = 0.0;
  double target_ = 0.0;
  double target_velocity_ = 0.0;
  std::int32_t target_counts_ = 0;
};

/// What a drive has stated of its units at its boot.
StatedFactors statedFactors(const canopen::Node& drive) noexcept;

}  // namespace tandem::hal
