// SPDX-License-Identifier: Apache-2.0
/** @file Hardware guards: conditions that the HAL monitors in addition to the gate, with counters. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "idl/enumerations.h"
#include "safety/faults.h"

namespace tandem::hal {

using idl::HardwareGuard;
using idl::name;
inline constexpr int kHardwareGuardCount = idl::count<HardwareGuard>;

using GuardMask = std::uint32_t;
constexpr GuardMask bit(HardwareGuard guard) { return 1u << static_cast<unsigned>(guard); }
/// "drive_fault, emergency" or "none".
std::string describeGuards(GuardMask guards);

/// Guards that invalidate the joint position; all others concern the drive.
inline constexpr GuardMask kSensorGuards =
    bit(HardwareGuard::kEncoderSilent) | bit(HardwareGuard::kEncoderAlarm) | bit(HardwareGuard::kEncoderMismatch);

/// Guards that stop the whole arm with its ramp; every other guard means that the axis itself is lost.
inline constexpr GuardMask kRampGuards =
    kSensorGuards | bit(HardwareGuard::kForeignMaster) | bit(HardwareGuard::kFramesLost);

/** Why a homing run failed (HardwareGuard::kHoming). */
enum class HomingFailure : std::uint8_t {
  kNone,
  kSetup,     ///< the drive has not taken an object of the run
  kDrive,     ///< the drive reports an error of its run (6041, bit 13)
  kPowerOff,  ///< the drive left operation during the run
  kLate,      ///< the run has not ended within `budget`
  kNoStop,    ///< the joint moved 1.1 times its range without a mechanical stop
};
/// With what to check; empty for kNone.
std::string_view describe(HomingFailure failure);

/// Fault that follows from guards (kSensor, kDrive, kStopRequested or none), with its cause.
safety::FaultRecord faultOf(GuardMask guards) noexcept;

/** Counts the activations of each guard. */
class HardwareGuardCounters {
 public:
  struct Entry {
    std::uint64_t count = 0;
    std::uint8_t arm = 0;  ///< of the last activation
    std::uint8_t joint = 0;
  };
  void add(GuardMask began, int arm, int joint) noexcept;
  const Entry& operator[](HardwareGuard guard) const noexcept { return entries_[static_cast<std::size_t>(guard)]; }

 private:
  std::array<Entry, kHardwareGuardCount> entries_{};
};

}  // namespace tandem::hal
