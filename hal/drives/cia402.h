// SPDX-License-Identifier: Apache-2.0
/** @file CiA 402 drive profile: states, transitions, mode-specific bits, descriptions of error codes.
 *
 * Pure logic over statusword and controlword, independent of the frames that carry them. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "idl/enumerations.h"
#include "safety/watchdog.h"

namespace tandem::hal {

using idl::DriveState;
using idl::name;

/// State encoded in a statusword (masks 0x4F and 0x6F of the profile).
DriveState driveState(std::uint16_t statusword) noexcept;

/** Modes of operation, object 0x6060. */
enum class DriveMode : std::int8_t {
  kNone = 0,
  kProfilePosition = 1,
  kProfileVelocity = 3,
  kHoming = 6,
  kCyclicPosition = 8,
  kCyclicVelocity = 9,
};
/// "cyclic synchronous position".
std::string_view name(DriveMode mode);
/// The drive's target is a velocity, 60FF.
constexpr bool targetIsVelocity(DriveMode mode) noexcept {
  return mode == DriveMode::kProfileVelocity || mode == DriveMode::kCyclicVelocity;
}
/// Object 0x6502 (supported modes) includes this mode.
bool supports(std::uint32_t supported_modes, DriveMode mode) noexcept;

/** Bits of the statusword that do not encode the state. */
namespace statusword {
inline constexpr std::uint16_t kFault = 1u << 3;
inline constexpr std::uint16_t kVoltageEnabled = 1u << 4;
inline constexpr std::uint16_t kWarning = 1u << 7;
inline constexpr std::uint16_t kRemote = 1u << 9;
inline constexpr std::uint16_t kTargetReached = 1u << 10;
inline constexpr std::uint16_t kInternalLimit = 1u << 11;
inline constexpr std::uint16_t kFollowsCommand = 1u << 12;       ///< cyclic modes: 0 = the target is ignored
inline constexpr std::uint16_t kSetPointAcknowledge = 1u << 12;  ///< profile position
inline constexpr std::uint16_t kHomingAttained = 1u << 12;       ///< homing
inline constexpr std::uint16_t kFollowingError = 1u << 13;       ///< cyclic and profile position
inline constexpr std::uint16_t kHomingError = 1u << 13;          ///< homing
}  // namespace statusword

/** Controlwords, object 0x6040. */
namespace controlword {
inline constexpr std::uint16_t kDisableVoltage = 0x00;
inline constexpr std::uint16_t kQuickStop = 0x02;
inline constexpr std::uint16_t kShutdown = 0x06;
inline constexpr std::uint16_t kSwitchOn = 0x07;  ///< also: disable operation
inline constexpr std::uint16_t kEnableOperation = 0x0F;
inline constexpr std::uint16_t kNewSetPoint = 1u << 4;        ///< profile position
inline constexpr std::uint16_t kStartHoming = 1u << 4;        ///< homing
inline constexpr std::uint16_t kChangeImmediately = 1u << 5;  ///< profile position
inline constexpr std::uint16_t kFaultReset = 1u << 7;         ///< acts on its rising edge
inline constexpr std::uint16_t kHalt = 1u << 8;
}  // namespace controlword

/** Requested power state of a drive. */
enum class PowerGoal : std::uint8_t {
  kOff,        ///< switch on disabled: no torque; the drive's quick stop first stops a joint that moves
  kOperation,  ///< operation enabled
};

/** Moves one drive to a goal, one confirmed transition after the other, and detects missing transitions.
 *
 * Torque goes off only if the caller permits it (the joint is at standstill, its brake holds), the drive switches it
 * off itself, or the stop budget has passed: until then a drive in operation gets a quick stop, and one in its quick
 * stop keeps it. A goal never clears a fault: only resetFault() does, with a written 0 in bit 7 before the 1, because
 * the profile requires an edge. Times are ns on the caller's clock; nothing allocates, locks or throws. */
class PowerSequence {
 public:
  /** @param transition_budget longest time for each state transition of the drive, s
   * @param stop_budget time after which torque goes off even if the joint moves, s */
  PowerSequence(double transition_budget, double stop_budget)
      : timeout_(transition_budget), stop_(stop_budget), late_stop_(stop_budget + transition_budget) {}

  void setGoal(PowerGoal goal, std::int64_t now) noexcept;
  PowerGoal goal() const noexcept { return goal_; }
  /// Requests one fault reset; without effect unless the drive is in fault.
  void resetFault(std::int64_t now) noexcept;

  /// Controlword for a drive in this state. @param may_release torque may go off.
  std::uint16_t step(DriveState state, bool may_release, std::int64_t now) noexcept;

  /// The drive has torque and has to lose it.
  bool braking() const noexcept {
    return goal_ == PowerGoal::kOff &&
           (state_ == DriveState::kOperationEnabled || state_ == DriveState::kQuickStopActive);
  }
  DriveState state() const noexcept { return state_; }
  /// The last state was the goal. For kOff: no torque, whether by command, after a fault or never switched on.
  bool reached() const noexcept;
  /// The drive has not shown the next state within the budget; stays until the next goal, reset or change of state.
  bool late(std::int64_t now) const noexcept { return !reached() && (braking() ? late_stop_ : timeout_).expired(now); }

 private:
  enum class Reset : std::uint8_t { kNone, kLow, kHigh };
  /// Cycles with bit 7 = 0 before the 1: the edge must survive one lost frame.
  static constexpr int kLowCycles = 3;

  std::uint16_t towardsOperation() const noexcept;
  std::uint16_t towardsOff(bool may_release) const noexcept;

  safety::Watchdog timeout_, stop_, late_stop_;
  PowerGoal goal_ = PowerGoal::kOff;
  DriveState state_ = DriveState::kUnknown;
  Reset reset_ = Reset::kNone;
  int low_cycles_ = 0;
};

/** State of a homing run (statusword bits 13, 12 and 10 in mode 6). */
enum class HomingState : std::uint8_t {
  kRunning,
  kInterrupted,     ///< or not started
  kAttainedMoving,  ///< reference found, the target is not yet reached
  kDone,
  kErrorMoving,
  kErrorStanding,
};
HomingState homingState(std::uint16_t statusword) noexcept;

/** Handshake of profile position: a set-point counts once per edge of bit 4, and bit 4 may rise only while the drive
 * shows bit 12 = 0. */
class SetPointHandshake {
 public:
  /// A new target in 0x607A is to be accepted.
  void request() noexcept { pending_ = true; }
  /// Bits to add to the controlword of an enabled drive.
  std::uint16_t step(std::uint16_t statusword) noexcept;
  /// All set-points are acknowledged.
  bool idle() const noexcept { return !pending_ && !raised_; }

 private:
  bool pending_ = false;
  bool raised_ = false;
};

/// Meaning of an error code (0x603F, or the code of an emergency message): "over-current (0x2310)"; unknown codes are
/// described by their class. 0 is "no error".
std::string describeErrorCode(std::uint16_t code);

}  // namespace tandem::hal
