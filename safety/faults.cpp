// SPDX-License-Identifier: Apache-2.0
#include "safety/faults.h"

#include <array>
#include <cstdio>
#include <utility>

#include "safety/joint_kinds.h"

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

constexpr std::array<std::string_view, 19> kCauses{"",
                                                   "off",
                                                   "following error",
                                                   "hal or sim started anew",
                                                   "left ENABLED by themselves",
                                                   "reported by the drives",
                                                   "no model",
                                                   "no solution",
                                                   "no states",
                                                   "commands are not taken",
                                                   "no answer",
                                                   "reports an error",
                                                   "drive and encoder disagree",
                                                   "overspeed",
                                                   "outside its limits",
                                                   "another master on the bus",
                                                   "torque",
                                                   "brake",
                                                   "emergency stop"};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return text;
}

}  // namespace

std::string describe(const FaultRecord& record, int joint_count) {
  std::string text = describeFaults(record.faults);
  const auto cause = static_cast<std::size_t>(record.cause);
  if (cause > 0 && cause < kCauses.size())
    text += " (" + std::string(kCauses[cause]) + ")";
  const bool has_joint = record.joint != FaultRecord::kNoJoint;
  if (has_joint)
    text += " of joint " + std::to_string(record.joint + 1);
  if (record.amount == 0.0 && record.allowed == 0.0)
    return text;
  const std::string unit = !has_joint ? " s" : isTranslation(record.joint, joint_count) ? " m" : " rad";
  text += ": " + number(record.amount) + unit;
  if (record.allowed > 0.0)
    text += ", allowed " + number(record.allowed) + unit;
  return text;
}

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
