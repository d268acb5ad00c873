// SPDX-License-Identifier: Apache-2.0
#include "safety/faults.h"

#include <array>
#include <utility>

namespace tandem::safety {
namespace {

constexpr std::array<std::pair<Fault, std::string_view>, 13> kFaultNames{{
    {Fault::kNotFinite, "not_finite"},
    {Fault::kStaleCommand, "stale_command"},
    {Fault::kOutOfSequence, "out_of_sequence"},
    {Fault::kStepTooLarge, "step_too_large"},
    {Fault::kUnknownArm, "unknown_arm"},
    {Fault::kCommandTimeout, "command_timeout"},
    {Fault::kStateTimeout, "state_timeout"},
    {Fault::kReferenceTimeout, "reference_timeout"},
    {Fault::kSensor, "sensor"},
    {Fault::kDrive, "drive"},
    {Fault::kStopRequested, "stop_requested"},
    {Fault::kLeaseLost, "lease_lost"},
    {Fault::kSolver, "solver"},
}};

constexpr std::array<std::string_view, kGuardCount> kGuardNames{
    "finite", "fresh", "sequence", "step", "known_arm", "position", "coupled_row", "velocity", "slew"};

}  // namespace

std::string describeFaults(FaultMask faults) {
  std::string text;
  const auto append = [&text](std::string_view name) {
    if (!text.empty())
      text += ", ";
    text += name;
  };
  for (const auto& [fault, name] : kFaultNames) {
    if (faults & bit(fault))
      append(name);
    faults &= ~bit(fault);
  }
  if (faults != 0)
    append("unknown");  // bits of a newer peer
  return text.empty() ? "none" : text;
}

std::string_view name(Guard guard) {
  const auto index = static_cast<std::size_t>(guard);
  return index < kGuardNames.size() ? kGuardNames[index] : "unknown";
}

}  // namespace tandem::safety
