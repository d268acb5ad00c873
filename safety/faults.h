// SPDX-License-Identifier: Apache-2.0
/** @file Faults, guards and what drives are asked: the vocabulary that hal, sim and control share. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tandem::safety {

/** Why an arm is in FAULT: bits of a latched mask. */
enum class Fault : std::uint32_t {
  kNotFinite = 1u << 0,         ///< a command held a number that is not finite
  kStaleCommand = 1u << 1,      ///< a command answered a state that is too old
  kOutOfSequence = 1u << 2,     ///< sequence repeated or went back, or a foreign session
  kStepTooLarge = 1u << 3,      ///< setpoint farther from the last one than max_step
  kUnknownArm = 1u << 4,        ///< a command for another number of arms
  kCommandTimeout = 1u << 5,    ///< no command within the budget
  kStateTimeout = 1u << 6,      ///< control: no fresh actuation/state
  kReferenceTimeout = 1u << 7,  ///< control: no fresh planning/reference
  kSensor = 1u << 8,            ///< a measurement is invalid
  kDrive = 1u << 9,             ///< a drive failed
  kStopRequested = 1u << 10,    ///< the stop topic
  kLeaseLost = 1u << 11,        ///< the commander fell silent while moving
  kSolver = 1u << 12,           ///< control: the solver failed
};

using FaultMask = std::uint32_t;
constexpr FaultMask bit(Fault fault) { return static_cast<FaultMask>(fault); }

/// "command_timeout, drive" or "none".
std::string describeFaults(FaultMask faults);

/** What lay behind a fault that can have several causes. */
enum class FaultCause : std::uint8_t {
  kUnspecified = 0,  ///< the fault itself says it
  kOff,              ///< kDrive: the drive has no power or is dead
  kFollowingError,   ///< kDrive: the joint does not follow its reference
  kRestarted,        ///< kDrive, control: hal or sim started anew
  kLeftEnabled,      ///< kDrive, control: the drives left ENABLED unasked
  kReported,         ///< control: the drives reported these faults
  kModel,            ///< kSolver: a kinematic model cannot answer for these joints
  kNoSolution,       ///< kSolver: the redundancy resolution failed
  kSilent,           ///< kStateTimeout: no states come
  kUnanswered,       ///< kStateTimeout: states come, but they answer old commands
  kNoAnswer,         ///< kDrive, kSensor: a device or its bus fell silent, or is not up
  kDeviceError,      ///< kDrive, kSensor: a device reports an error of its own
  kDisagree,         ///< kSensor: drive and absolute encoder disagree
  kOverspeed,        ///< kDrive: the joint is faster than its axis may be
  kOutsideLimits,    ///< kDrive: the joint stands outside its limits, or a limit of the drive holds it back
  kForeignMaster,    ///< kDrive: somebody else commands the bus
  kTorque,           ///< kDrive: torque beyond what the axis may need
  kBrake,            ///< kDrive: the brake did not hold, or did not open
  kEmergencyStop,    ///< kStopRequested: the emergency stop, or a drive's STO
};

/** The first thing that led an arm into FAULT since it was last cleared: for logs and people. Amounts are in the unit
 * of what is compared: s for ages and silences, m or rad for joints; 0 where nothing is measured. */
struct FaultRecord {
  static constexpr std::uint8_t kNoJoint = 255;

  FaultMask faults = 0;  ///< 0: no fault
  FaultCause cause = FaultCause::kUnspecified;
  std::uint8_t joint = kNoJoint;  ///< counts from 0
  double amount = 0.0;
  double allowed = 0.0;
};

/// "drive (following error) of joint 4: 0.031 rad, allowed 0.02 rad", "command_timeout: 0.151 s, allowed 0.15 s".
/// Joints count from 1 there. @param joint_count of the arm: the first half are translations.
std::string describe(const FaultRecord& record, int joint_count);

/** Guards of the gate. Integrity guards stop the arm and latch; limit guards saturate joint by joint. */
enum class Guard : std::uint8_t {
  kFinite = 0,
  kFresh,
  kSequence,
  kStep,
  kKnownArm,  // integrity
  kPosition,
  kCoupledRow,
  kVelocity,
  kSlew,  // limits
};
inline constexpr int kGuardCount = 9;
std::string_view name(Guard guard);

/** What control asks of the drives of an arm. */
enum class DriveRequest : std::uint8_t { kKeep = 0, kDisable, kEnable, kPause, kResume, kRecover };

}  // namespace tandem::safety
