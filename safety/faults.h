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
enum class DriveRequest : std::uint8_t { kKeep = 0, kDisable, kEnable, kPause, kResume };

}  // namespace tandem::safety
