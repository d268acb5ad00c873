// SPDX-License-Identifier: Apache-2.0
/** @file Protections: what a drive does by itself when the HAL or its own motion fails, and whether it has the objects
 * for it. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::hal {

/** A protection; the comment names the objects without which the drive does not have it (CiA 301, CiA 402). */
enum class Protection : std::uint8_t {
  kCommandDeadline,     ///< 1400:05: stops when no command PDO arrives
  kHeartbeatWatch,      ///< 1016:01: stops when the HAL's heartbeat ends
  kConnectionReaction,  ///< 6007: the stop after a lost connection is a quick stop
  kQuickStopRamp,       ///< 605A, 6085: deceleration of a quick stop, and torque off after it
  kFaultReaction,       ///< 605E: quick stop after a fault of the drive
  kFollowingError,      ///< 6065, 6066: the drive's own following error window
};
inline constexpr int kProtectionCount = 6;

using ProtectionMask = std::uint32_t;
constexpr ProtectionMask bit(Protection protection) { return 1u << static_cast<unsigned>(protection); }

/// Name in a hardware file: "command_deadline".
std::string_view name(Protection protection);
/// "command_deadline (1400:05), fault_reaction (605E)" or "none".
std::string describeProtections(ProtectionMask protections);

/** A protection that somebody has agreed to do without, at one axis. */
struct AcceptedLoss {
  Protection protection = Protection::kCommandDeadline;
  std::string reason;
};

/** Sets of protections, of each of which a drive must have at least one: a watch on the HAL, the quick stop that this
 * watch starts, and the ramp of that quick stop. @param accepted sets with one of these are left out. */
std::vector<ProtectionMask> leastProtections(const std::vector<AcceptedLoss>& accepted);

}  // namespace tandem::hal
