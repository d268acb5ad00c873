// SPDX-License-Identifier: Apache-2.0
/** @file Protections: what a drive does by itself when the HAL or its own motion fails, and whether it has the objects
 * for it. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "idl/enumerations.h"

namespace tandem::hal {

using idl::name;
using idl::Protection;
inline constexpr int kProtectionCount = idl::count<Protection>;

using ProtectionMask = std::uint32_t;
constexpr ProtectionMask bit(Protection protection) { return 1u << static_cast<unsigned>(protection); }

/// "command_deadline (1400:05), fault_reaction (605E)" or "none".
std::string describeProtections(ProtectionMask protections);

/** Accepted loss: a protection that one axis lacks by agreement in the hardware file. */
struct AcceptedLoss {
  Protection protection = Protection::kCommandDeadline;
  std::string reason;
};

/// Sets of leastProtections() of which a drive with these losses has none: its boot fails.
std::vector<ProtectionMask> missingProtections(ProtectionMask lost, const std::vector<AcceptedLoss>& accepted);

/** Sets of protections, of each of which a drive must have at least one: a watch on the HAL, the quick stop that this
 * watch starts, and the ramp of that quick stop. @param accepted sets with one of these are left out. */
std::vector<ProtectionMask> leastProtections(const std::vector<AcceptedLoss>& accepted);

}  // namespace tandem::hal
