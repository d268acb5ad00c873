// SPDX-License-Identifier: Apache-2.0
/** @file One axis: drive, absolute encoder, and the guards on both. */
#pragma once

#include <cstdint>

#include "hal/brake.h"
#include "hal/canopen/network.h"
#include "hal/feedback.h"
#include "hal/guards.h"
#include "hal/hardware.h"
#include "hal/measured_motion.h"
#include "hal/sdo_jobs.h"
#include "hal/torque_guard.h"
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

  /// Resets and configures the nodes; everything that stood against the axis is forgotten.
  void boot(std::int64_t now) noexcept;

  /// Takes in what the network has received, after Network::receive(), once per period.
  void update(std::int64_t now) noexcept;
  void onEmcy(int node, const canopen::Emcy& emcy) noexcept;

  /// Where the drive shall go; kOperation only while phase() is kReady (or in a homing run).
  void setGoal(PowerGoal goal, std::int64_t now) noexcept { power_.setGoal(goal, now); }
  /// Where the joint shall be and how fast it shall move there, m or rad, m/s or rad/s.
  void setTarget(double position, double velocity) noexcept;
  /// The target follows the joint as long as the drive has no torque, and stays when it gets torque.
  void hold() noexcept { holding_ = true; }
  /// Writes controlword and target into the RPDO, before Network::transmit().
  void writeCommand(std::int64_t now) noexcept;

  AxisPhase phase() const noexcept { return phase_; }
  /// What stands against the axis now. Guards that only mean something in operation count while `operating`.
  GuardMask guards() const noexcept { return guards_; }
  /// The fault that follows from these guards, with what lies behind it.
  safety::FaultRecord failure(GuardMask guards) const noexcept;
  /// The HAL moves or holds the joint: the guards of operation count from now on.
  void setOperating(bool operating) noexcept;
  /// A guard that whoever leads the axis has found; it stays until the next boot.
  void fail(HardwareGuard guard) noexcept;

  DriveState driveState() const noexcept { return power_.state(); }
  PowerGoal goal() const noexcept { return power_.goal(); }
  bool goalReached() const noexcept { return power_.reached(); }
  bool goalLate(std::int64_t now) const noexcept { return power_.late(now); }
  /// In operation, its brake is open, and the drive says that it follows the target.
  bool followsCommand() const noexcept;
  /// Its drive has failed or fallen silent: what it measured last says nothing of now.
  bool unresponsive() const noexcept {
    return phase_ == AxisPhase::kFailed || (guards_ & bit(HardwareGuard::kDriveSilent)) != 0;
  }
  /// By measurement: nothing is to be stopped.
  bool atRest() const noexcept { return motion_.atRest(); }
  /// The HAL moves or holds the joint.
  bool operating() const noexcept { return operating_; }
  std::uint16_t statusword() const noexcept { return statusword_; }
  /// Bits to be added to the controlword: those of the mode.
  void setModeBits(std::uint16_t bits) noexcept { mode_bits_ = bits; }

  bool referenced() const noexcept { return phase_ == AxisPhase::kReady; }
  /// Referenced, and drive and encoder answer and agree.
  bool valid() const noexcept;
  double position() const noexcept { return position_; }           ///< by the drive, m or rad; 0 before the reference
  double velocity() const noexcept { return motion_.velocity(); }  ///< as measured, m/s or rad/s
  double target() const noexcept { return target_; }               ///< m or rad
  double encoderPosition() const noexcept { return encoder_position_; }
  double followingError() const noexcept { return following_.error(); }  ///< m or rad
  std::uint16_t errorCode() const noexcept { return error_code_; }       ///< of the last emergency, 0: none
  /// Share of the last 100 TPDOs that came, of its drive or of its encoder, whichever is less; 0 to 1.
  double feedbackSuccess() const noexcept;
  /// Of the drive, degrees Celsius; NaN where it is not known.
  double temperature() const noexcept { return temperature_; }
  const AxisConfig& config() const noexcept { return config_; }
  const AxisUnits& units() const noexcept { return units_; }
  canopen::Node& driveNode() noexcept { return network_.node(drive_); }
  const canopen::Node& driveNode() const noexcept { return network_.node(drive_); }
  /// nullptr where there is none.
  const canopen::Node* encoderNode() const noexcept { return encoder_ < 0 ? nullptr : &network_.node(encoder_); }
  int driveIndex() const noexcept { return drive_; }
  int encoderIndex() const noexcept { return encoder_; }

  /// SDO accesses while the axis runs: for homing runs; stepJobs() lets them go on.
  SdoJobs& jobs() noexcept { return jobs_; }
  SdoJobs::Status stepJobs(std::int64_t now) noexcept;
  /// Software limits of the drive with room for where the joint stands now, or as configured. Only without torque.
  void setRecovering(bool recovering) noexcept;
  /// The drive's software limits are being written.
  bool settingLimits() const noexcept { return limits_pending_; }
  /// These counts stand for this position from now on; software limits are set anew. Only without torque.
  void rereference(std::int32_t counts, double position) noexcept;

 private:
  void updateNodes(std::int64_t now) noexcept;
  void readDrive(std::int64_t now) noexcept;
  void readEncoder(std::int64_t now) noexcept;
  void reference() noexcept;
  void setLimits() noexcept;
  void finishLimits(std::int64_t now) noexcept;
  void moveBrake(std::int64_t now) noexcept;
  bool mayRelease(std::int64_t now) noexcept;
  void readTemperature(std::int64_t now) noexcept;
  void judge(std::int64_t now) noexcept;
  void judgeMotion(std::int64_t now) noexcept;
  void noteGuard(HardwareGuard guard, bool stands) noexcept;

  AxisConfig config_;
  double period_;
  FeedbackBudget feedback_budget_;
  canopen::Network& network_;
  int drive_;
  int encoder_ = -1;
  AxisUnits units_;
  AxisUnits encoder_units_;
  PowerSequence power_;
  MeasuredMotion motion_;
  std::optional<Brake> brake_;
  TorqueGuard torque_;
  SdoJobs jobs_;
  AxisPhase phase_ = AxisPhase::kBooting;
  GuardMask guards_ = 0;
  GuardMask latched_ = 0;  ///< by fail(), until the next boot
  bool operating_ = false;
  bool free_to_move_ = true;    ///< no closed brake
  bool closing_ = false;        ///< the brake, before torque goes
  std::int64_t stopping_ = 0;   ///< since when the drive is to stop and lose its torque, ns
  double stopping_from_ = 0.0;  ///< its speed then, m/s or rad/s
  bool holding_ = true;
  bool fault_reset_ = false;     ///< one is due, should the drive show a fault after its boot
  bool limits_pending_ = false;  ///< software limits are being written
  bool recovering_ = false;      ///< they have room for a joint that stands outside

  std::int64_t sampled_ = 0;  ///< when the last SYNC was sent, ns: what TPDOs of this period hold
  FeedbackStream drive_stream_;
  FeedbackStream encoder_stream_;
  FollowingWatch following_;
  std::uint16_t statusword_ = 0;
  std::int32_t counts_ = 0;
  std::uint16_t mode_bits_ = 0;
  std::uint16_t error_code_ = 0;
  bool emergency_ = false;
  bool encoder_emergency_ = false;
  bool encoder_alarm_ = false;
  double position_ = 0.0;
  double encoder_position_ = 0.0;
  double target_ = 0.0;
  double target_velocity_ = 0.0;
  double temperature_;
  std::int64_t next_temperature_ = 0;  ///< when it is read again, ns
  std::int32_t target_counts_ = 0;
};

}  // namespace tandem::hal
