// SPDX-License-Identifier: Apache-2.0
/** @file Client requests as plain structs for the periodic thread, and their replies. */
#pragma once

#include "operation/permission.h"
#include "planning/reference_tracker.h"

namespace tandem::operation {

/** A request with all checks that do not depend on the robot's state. */
struct ParsedControlRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  msg::ControlKind kind = msg::ControlKind::kKeepLease;
  int arm = msg::kAllArms;
  bool from_topic = false;                                 ///< from arm_x/state_command, which carries no client
  std::uint64_t control_session = 0, answers_control = 0;  ///< of the last control/status that its sender received
  safety::StateCommand command = safety::StateCommand::kDisable;
  int joint_count = 0;
  std::array<double, safety::kMaxJointsPerArm> joints{};
  planning::ReferenceTracker* tracker = nullptr;  ///< a method change: the tracker to use from now on
};

/// Action that a request needs permission for.
inline Action actionOf(const ParsedControlRequest& request) noexcept {
  using enum idl::Action;
  constexpr std::array kOfKind{kAcquireLease, kReleaseLease, kKeepLease, kEnable, kSetMethod, kSetMethod,
                               kMoveJp,       kJog,          kHome,      kHold,   kWithdraw};
  static_assert(kOfKind.size() == idl::count<msg::ControlKind>, "each ControlKind needs its Action here");
  return request.kind == msg::ControlKind::kStateCommand ? static_cast<Action>(request.command)
                                                         : kOfKind[static_cast<std::size_t>(request.kind) - 1];
}

/// Whether an action acquires or keeps the lease.
constexpr bool isOfLease(Action action) noexcept {
  return action == Action::kAcquireLease || action == Action::kKeepLease;
}

/** Reply to a request, for the publishing thread. */
struct ControlReply {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  Refusal refusal;
  planning::ReferenceTracker* retired = nullptr;  ///< no longer used by the periodic thread: delete it
  bool method_accepted = false;
  std::uint64_t owner = 0;   ///< lease owner before the request
  std::uint64_t status = 0;  ///< sequence of the last control/status before the request
};

}  // namespace tandem::operation
