// SPDX-License-Identifier: Apache-2.0
// Wrong variants of the skeleton of docs/own-hardware.md: a process with WRONG=NAME in its environment does what the
// function says.
#pragma once

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "safety/robot_command.h"

namespace wrong {

inline bool is(const char* name) {
  static const char* const chosen = std::getenv("WRONG");
  return chosen != nullptr && std::strcmp(chosen, name) == 0;
}

inline tandem::safety::ArmLimits limits(tandem::safety::ArmLimits limits) {
  if (!is("no_limits"))
    return limits;
  limits.rows.clear();
  for (tandem::safety::JointLimit& joint : limits.joints) {
    joint.lower = -tandem::safety::kUnlimited;
    joint.upper = joint.velocity = tandem::safety::kUnlimited;
  }
  return limits;
}

inline tandem::safety::StreamHeader header(tandem::safety::StreamHeader header) {
  static std::uint64_t count = 0;
  header.age = is("any_age") ? 0.0 : header.age;
  header.sequence = is("any_sequence") ? ++count : header.sequence;
  header.arm_count = is("any_arms") ? 2 : header.arm_count;
  return header;
}

inline tandem::safety::ArmRequest request(tandem::safety::ArmRequest request, tandem::safety::OperatingState state) {
  using enum tandem::safety::DriveRequest;
  if (is("no_latch") && state == tandem::safety::OperatingState::kFault)
    request.request = kDisable;
  if ((is("no_pause") && request.request == kPause) || (is("no_disable") && request.request == kDisable))
    request.request = kKeep;
  if (is("no_hold") && !request.moving) {
    request.moving = true;
    request.motion.velocity.setConstant(1e-3);
  }
  if (is("any_number"))
    request.motion.velocity =
        request.motion.velocity.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; }).eval();
  return request;
}

/// Position that the supervisor takes as the measured one.
inline tandem::safety::ArmVector measured(const tandem::safety::ArmVector& position) {
  return position.array() + (is("jumps") ? 0.3e-3 : 0.0);
}

/// Velocity without power, m/s and rad/s.
inline double idle(tandem::safety::OperatingState state) {
  const bool goes_on = is("goes_on") && state == tandem::safety::OperatingState::kFault;
  return goes_on ? 2e-3 : is("creeps") ? 1e-3 : 0.0;
}

}  // namespace wrong
