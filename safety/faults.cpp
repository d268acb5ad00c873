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
      return "Check the load of the machine and the network. Disable to clear it, then enable.";
    case Fault::kOutOfSequence:
      return "Make sure that one tandem-control runs. Disable to clear it, then enable.";
    case Fault::kUnknownArm:
      return "Start all processes with the same robot file.";
    case Fault::kCommandTimeout:
      return "Is tandem-control running, and does nothing get lost (tandem status: arrived)? Disable to clear it, then "
             "enable.";
    case Fault::kStateTimeout:
      return "Is tandem-sim or tandem-hal running, and does nothing get lost (tandem status: arrived)? Disable to "
             "clear it, then enable.";
    case Fault::kReferenceTimeout:
      return "Is tandem-planning running? Disable to clear it, then enable.";
    case Fault::kSensor:
      return "Check the encoder and its cable; disable when the reading is good again.";
    case Fault::kDrive:
      return "Look for what blocks the joint, check the drive; then disable and enable.";
    case Fault::kStopRequested:
      return "When it is safe to go on: take control, disable, then enable.";
    case Fault::kLeaseLost:
      return "Take control. Disable to clear it, then enable.";
    case Fault::kSolver:
      return "Move the joints by hand (jog) or choose another method, after disable and enable.";
    case Fault::kMismatch:
      return "`tandem status` names who it is and what differs: end it, or give it the same files; then disable and "
             "enable.";
    case Fault::kNotFinite:
    case Fault::kStepTooLarge:
      break;
  }
  return "Disable to clear it, then enable.";
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
