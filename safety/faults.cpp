// SPDX-License-Identifier: Apache-2.0
#include "safety/faults.h"

#include <cstdio>

#include "safety/limits.h"

namespace tandem::safety {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return text;
}

}  // namespace

std::string describe(const FaultRecord& record, const ArmLimits* limits) {
  std::string text = describeFaults(record.faults);
  if (const idl::Entry<FaultCause>* cause = idl::find(record.cause); cause != nullptr && !cause->name.empty())
    text += " (" + std::string(cause->name) + ")";
  const bool has_joint = record.joint != idl::kNoJoint;
  if (has_joint)
    text += " of joint " + std::to_string(record.joint + 1);
  if (record.amount == 0.0 && record.allowed == 0.0)
    return text;
  const bool share = record.cause == FaultCause::kLost;
  if ((record.faults & bit(Fault::kClearance)) != 0 && record.cause == FaultCause::kUnspecified)
    return text + ": " + number(1e3 * record.amount) + " mm, expected at least " + number(1e3 * record.allowed) + " mm";
  const bool known = limits != nullptr && record.joint < limits->jointCount();
  const std::string unit = share                                 ? " of the last 100"
                           : !has_joint                          ? " s"
                           : !known                              ? " m or rad"
                           : limits->isTranslation(record.joint) ? " m"
                                                                 : " rad";
  text += ": " + number(record.amount) + unit;
  if (record.allowed > 0.0)
    text += ", allowed " + number(record.allowed) + unit;
  return text;
}

std::string_view remedy(Fault fault) {
  switch (fault) {
    case Fault::kStaleCommand:
      return "Check the load of processor and network. Disable to clear the fault, then enable.";
    case Fault::kOutOfSequence:
      return "Check that exactly one tandem-control runs. Disable to clear the fault, then enable.";
    case Fault::kUnknownArm:
      return "Start all processes with the same robot file.";
    case Fault::kCommandTimeout:
      return "Check that tandem-control runs and that no commands are lost (`tandem status`, \"arrived of the "
             "last 100\"). Disable to clear the fault, then enable.";
    case Fault::kStateTimeout:
      return "Check that tandem-sim or tandem-hal runs and that no states are lost (`tandem status`, \"arrived of the "
             "last 100\"). Disable to clear the fault, then enable.";
    case Fault::kReferenceTimeout:
      return "Check that tandem-planning runs. Disable to clear the fault, then enable.";
    case Fault::kSensor:
      return "Check the encoder and its cable; when the reading is valid again, disable, then enable.";
    case Fault::kDrive:
      return "Remove what blocks the joint and check the drive; then disable and enable.";
    case Fault::kStopRequested:
      return "When it is safe to continue: take control, disable, then enable.";
    case Fault::kLeaseLost:
      return "Take control, disable to clear the fault, then enable.";
    case Fault::kSolver:
      return "Disable, enable, then jog the joints away from this pose, or choose another method.";
    case Fault::kMismatch:
      return "`tandem status` lists the other process and the keys that differ: stop it, or start it with the same "
             "files; then disable and enable.";
    case Fault::kClearance:
      return "`tandem status` names the nearest bodies. Disable to clear the fault, enable, then jog them apart: only "
             "an approach stops the arms again.";
    case Fault::kNotFinite:
    case Fault::kStepTooLarge:
      break;
  }
  return "Disable to clear the fault, then enable.";
}

std::string describeFaults(FaultMask faults) {
  std::string text;
  const auto append = [&text](std::string_view name) {
    if (!text.empty())
      text += ", ";
    text += name;
  };
  for (const auto& [fault, name, meaning] : idl::Enumeration<Fault>::entries) {
    if (faults & bit(fault))
      append(name);
    faults &= ~bit(fault);
  }
  if (faults != 0)
    append("unknown");  // bits of a newer peer
  return text.empty() ? "none" : text;
}

}  // namespace tandem::safety
