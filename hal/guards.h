// SPDX-License-Identifier: Apache-2.0
/** @file The hardware's guards: what the HAL watches beside the gate, and what became of it. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "safety/faults.h"

namespace tandem::hal {

/** What can be wrong with an axis. */
enum class HardwareGuard : std::uint8_t {
  kNode = 0,         ///< drive or encoder: boot failed, heartbeat lost, left operational, rebooted
  kDriveSilent,      ///< no TPDO of the drive within the budget
  kDriveFault,       ///< the drive shows a fault
  kEmergency,        ///< an emergency message of drive or encoder, not yet taken back
  kPowerLost,        ///< the drive left operation by itself
  kFollowing,        ///< the joint is not where it was told to be
  kIgnoresCommand,   ///< in operation, but statusword bit 12 says that the target is ignored
  kSwitchOn,         ///< the drive did not come into operation, or out of a fault, within the budget
  kEncoderSilent,    ///< no TPDO of the absolute encoder within the budget
  kEncoderAlarm,     ///< the absolute encoder says that its position is wrong
  kEncoderMismatch,  ///< drive and absolute encoder disagree
  kReference,        ///< the position could not be referenced, or software limits not be set
  kHoming,           ///< a homing run failed
  kBus,              ///< bus-off, interface down, or setpoints no longer leave
  kOverspeed,        ///< the joint was measured to be faster than its axis may be
  kInternalLimit,    ///< in operation, and statusword bit 11: a limit of the drive holds the target back
  kForeignMaster,    ///< somebody else sends what only this HAL may send
  kTorque,           ///< torque or current beyond what the axis may need
  kBrake,            ///< the brake did not hold, or did not open
  kEmergencyStop,    ///< the emergency stop, or the drive's STO, is active
};
inline constexpr int kHardwareGuardCount = 20;
std::string_view name(HardwareGuard guard);  ///< "encoder_mismatch" ...

using GuardMask = std::uint32_t;
constexpr GuardMask bit(HardwareGuard guard) { return 1u << static_cast<unsigned>(guard); }
/// "drive_fault, emergency" or "none".
std::string describeGuards(GuardMask guards);

/// Guards that question where the joint is; all others question the drive.
inline constexpr GuardMask kSensorGuards =
    bit(HardwareGuard::kEncoderSilent) | bit(HardwareGuard::kEncoderAlarm) | bit(HardwareGuard::kEncoderMismatch);

/// Guards on which an arm stops as a whole, with its ramp; with all others the axis itself is lost.
inline constexpr GuardMask kRampGuards = kSensorGuards | bit(HardwareGuard::kForeignMaster);

/// The fault of the operating state that follows from guards: kSensor, kDrive, kStopRequested or none.
safety::FaultMask faultsOf(GuardMask guards) noexcept;

/** Counts how often each guard began to act. */
class HardwareGuardCounters {
 public:
  struct Entry {
    std::uint64_t count = 0;
    std::uint8_t arm = 0;  ///< of the last time
    std::uint8_t joint = 0;
  };
  void add(GuardMask began, int arm, int joint) noexcept;
  const Entry& operator[](HardwareGuard guard) const noexcept { return entries_[static_cast<std::size_t>(guard)]; }

 private:
  std::array<Entry, kHardwareGuardCount> entries_{};
};

}  // namespace tandem::hal
