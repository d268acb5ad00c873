// SPDX-License-Identifier: Apache-2.0
/** @file Interface to the drive of one axis, and to its absolute encoder, whatever bus or library is behind them. */
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "hal/drives/cia402.h"
#include "hal/drives/protections.h"

namespace tandem::hal {

/** Whether the devices of an axis, its drive and its encoder, are ready for use. */
enum class DriverPhase : std::uint8_t {
  kBooting,  ///< being reset and configured
  kUp,       ///< all devices deliver feedback
  kFailed,   ///< until the next boot
};

/** Progress of something that takes a drive more than one period. */
enum class Progress : std::uint8_t { kIdle, kBusy, kDone, kFailed };

/** Samples of one device since the start. The difference of both is what was lost. */
struct Arrivals {
  std::uint64_t received = 0;
  std::uint64_t expected = 0;  ///< one per period
};

/** Last sample of a drive. */
struct DriveFeedback {
  Arrivals arrivals;
  std::int64_t time = 0;                     ///< at which the drive sampled it, ns
  DriveState state = DriveState::kNotReady;  ///< drives without these states: see nextState()
  double position = 0.0;                     ///< of the joint from the drive's own zero, m or rad
  double torque = 0.0;                       ///< or current, share of the rated one, with sign; 0: not measured
  bool follows = true;                       ///< false: the drive reports that it ignores its target
  bool limited = false;  ///< the drive reports that it does not move to its target because of a limit
  bool at_lower = false, at_upper = false;  ///< the limit switch of this direction of the joint is active
};

/** Last sample of an absolute encoder. */
struct EncoderFeedback {
  Arrivals arrivals;
  double position = 0.0;  ///< of the joint, m or rad
  bool alarm = false;     ///< the encoder reports that its position may be wrong
};

/** Last sample of the digital inputs of a drive. */
struct DriveInputs {
  bool up = false;      ///< the drive delivers them
  bool failed = false;  ///< the drive has failed
  Arrivals arrivals;
  std::uint32_t bits = 0;
};

/** Command to one drive for one period. */
struct DriveCommand {
  std::uint16_t word = controlword::kDisableVoltage;  ///< one of namespace controlword
  double position = 0.0;                              ///< target from the drive's own zero, m or rad
  /// m/s or rad/s. Of a drive that takes velocities (targetIsVelocity()), its target; else that of the position target.
  double velocity = 0.0;
};

/** Task for which a drive is prepared while it has no torque. */
enum class DriveTask : std::uint8_t {
  kFollow = 0,  ///< the targets in DriveCommand
  kHome,        ///< a homing run by itself
  kPush,        ///< the targets, with the torque limited to HardStopConfig::torque
};

/** Reason of the failure of a device, in numbers: AxisDriver::describe() words it on another thread. */
struct DeviceFailure {
  std::uint8_t reason = 0;  ///< 0: none
  std::int32_t step = -1;
  std::uint32_t code = 0;
  std::uint64_t value = 0;
};

/// State after a controlword, of a drive without the states of CiA 402: kOperationEnabled and kQuickStopActive are
/// those with torque. A drive in fault keeps it until controlword::kFaultReset.
constexpr DriveState nextState(DriveState state, std::uint16_t word) noexcept {
  if (state == DriveState::kFault)
    return word == controlword::kFaultReset ? DriveState::kSwitchOnDisabled : DriveState::kFault;
  const bool torque = state == DriveState::kOperationEnabled || state == DriveState::kQuickStopActive;
  switch (word) {
    case controlword::kShutdown:
      return DriveState::kReadyToSwitchOn;
    case controlword::kSwitchOn:
      return DriveState::kSwitchedOn;
    case controlword::kEnableOperation:
      return DriveState::kOperationEnabled;
    case controlword::kQuickStop:
      return torque ? DriveState::kQuickStopActive : DriveState::kSwitchOnDisabled;
    default:
      return DriveState::kSwitchOnDisabled;
  }
}

/** Drive of one axis and, if AxisConfig::encoder is set, its absolute encoder.
 *
 * Axis calls it on the periodic thread: update() once per period after Fieldbus::receive(), command() once per period
 * before Fieldbus::transmit(), the others in between. What is noexcept must not allocate, lock, wait or throw. m, rad,
 * s; times in ns on the caller's clock; signs are those of the joint (Gearing::reversed). */
class AxisDriver {
 public:
  virtual ~AxisDriver() = default;

  /// Resets and configures the devices. Torque is off at the end; a brake that the HAL controls is closed.
  virtual void boot(std::int64_t now) noexcept = 0;
  /// Advances boot, configuration and parameter access.
  virtual void update(std::int64_t now) noexcept = 0;
  virtual DriverPhase phase() const noexcept = 0;
  /// Protections that the devices lack since the last boot.
  virtual ProtectionMask lostProtections() const noexcept { return 0; }

  virtual const DriveFeedback& drive() const noexcept = 0;
  virtual const EncoderFeedback& encoder() const noexcept = 0;
  /// @param of_status  EmergencyInput::statusword: bits of the drive's status instead of its digital inputs
  virtual DriveInputs inputs([[maybe_unused]] bool of_status) const noexcept { return {}; }
  /// A device has reported an error that it has not withdrawn.
  virtual bool emergency() const noexcept { return false; }
  /// Last error that a device has reported since its boot, 0: none.
  virtual std::uint16_t errorCode() const noexcept { return 0; }
  /// Of the drive, degrees Celsius; NaN: not known.
  virtual double temperature() const noexcept { return std::numeric_limits<double>::quiet_NaN(); }

  virtual void command(const DriveCommand& command, std::int64_t now) noexcept = 0;

  /// Gives the drive software limits, from its own zero, m or rad; only without torque. kFailed: it cannot have them,
  /// and the axis does not become ready. A drive without software limits: kDone, and they are lost protections.
  virtual void setLimits(double lower, double upper) noexcept = 0;
  virtual Progress limits() const noexcept = 0;

  /// Prepares the drive for a task, only without torque; a boot prepares it for kFollow.
  virtual void prepare(DriveTask task) noexcept = 0;
  virtual Progress prepared() const noexcept = 0;
  /// kDone: the drive shows in operation that it does its task; it does not move before. kFailed: it does something
  /// else.
  virtual Progress confirmed() const noexcept { return Progress::kDone; }
  /// Starts the run that DriveTask::kHome has prepared; at its end the drive's position is 0 at the place found.
  virtual void startHoming() noexcept {}
  /// Ends it, wherever it is.
  virtual void endHoming() noexcept {}
  virtual Progress homing() const noexcept { return Progress::kFailed; }

  /// Begins to open or close the brake, with AxisConfig::brake. False: not in this period.
  virtual bool setBrake([[maybe_unused]] bool closed) noexcept { return false; }
  virtual Progress brake() const noexcept { return Progress::kIdle; }

  // The publisher thread calls these beside the periodic one: they read only what does not change after start().
  /// Name of a device for people: "arm_a translation 1 (node 3)".
  virtual std::string deviceName(bool encoder) const = 0;
  virtual std::string describe(const DeviceFailure& failure, bool encoder) const = 0;
  /// Remarks on a drive that is ready, each beginning with "; ", empty: none.
  virtual std::string remarks() const { return {}; }
};

}  // namespace tandem::hal
