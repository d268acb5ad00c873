// SPDX-License-Identifier: Apache-2.0
/** @file Faults, guards and drive requests: enumerations shared by hal, sim and control. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "idl/enumerations.h"

namespace tandem::safety {

struct ArmLimits;

using idl::Fault;
using idl::name;
using FaultMask = std::uint32_t;
using idl::bit;

/// Remedy for a fault: one or two sentences for a person.
std::string_view remedy(Fault fault);

/// Whether a fault is a time-out: a busy machine also causes those.
constexpr bool isOfTime(FaultMask faults) noexcept {
  return (faults & (bit(Fault::kStaleCommand) | bit(Fault::kCommandTimeout) | bit(Fault::kStateTimeout) |
                    bit(Fault::kReferenceTimeout) | bit(Fault::kLeaseLost))) != 0;
}

/// Lateness of a wake-up above which it is reported with such a fault, s.
inline constexpr double kLate = 0.02;

/// "command_timeout, drive" or "none".
std::string describeFaults(FaultMask faults);

using idl::FaultCause;

/** First cause of the FAULT state of an arm since the last clear, for logs. Amounts are in the unit of the
 * compared quantity: s for ages and silences, m or rad for joints, a share for lost samples; 0 if nothing is measured.
 */
struct FaultRecord {
  FaultMask faults = 0;  ///< 0: no fault
  FaultCause cause = FaultCause::kUnspecified;
  std::uint8_t joint = idl::kNoJoint;  ///< counts from 0
  double amount = 0.0;
  double allowed = 0.0;
};

/// "drive (following error) of joint 4: 0.031 rad, allowed 0.02 rad", "command_timeout: 0.151 s, allowed 0.15 s". Joint
/// numbers in the text start at 1.
/// @param limits  of the arm, to identify translations
std::string describe(const FaultRecord& record, const ArmLimits* limits = nullptr);

using idl::Guard;
inline constexpr int kGuardCount = idl::count<Guard>;

using idl::DriveRequest;

}  // namespace tandem::safety
