// SPDX-License-Identifier: Apache-2.0
/** @file Permissions: decides whether a client may perform an action now; a refusal has a reason and a remedy. */
#pragma once

#include <array>
#include <string>

#include "config/config.h"
#include "idl/messages.h"
#include "planning/follower.h"
#include "safety/limits.h"
#include "safety/operating_state.h"

namespace tandem::operation {

using idl::Action;
using idl::name;
inline constexpr int kActions = idl::count<Action>;

/** Client that requests an action. */
enum class Requester : std::uint8_t {
  kLeaseOwner = 0,  ///< has the control lease
  kNoLeaseOwner,    ///< the lease is free
  kOtherClient,     ///< another client has the lease
};
/// Client 0 and msg::kCrtkClient count as no client.
Requester requesterOf(std::uint64_t client, std::uint64_t lease_owner) noexcept;
/// CRTK topics carry no client: their writers may command while no client has the lease.
Requester crtkRequester(std::uint64_t lease_owner) noexcept;

using Reason = idl::RefusalReason;  ///< its name is a sentence with the remedy

/** Refusal of an action with its reason. Converts to true; the default, false, is permission. */
struct Refusal {
  Reason reason = Reason::kNone;
  Action action = Action::kHold;
  safety::OperatingState state{};    ///< kWrongState: of the arm
  std::int8_t arm = -1;              ///< the arm that is the reason; -1: none
  safety::LimitViolation outside{};  ///< kOutsideLimits, kGoalOutside

  explicit operator bool() const noexcept { return reason != Reason::kNone; }
  msg::ReplyCode code() const noexcept;
};
/// Full text for people: the reason with arm, joint and amount where relevant.
std::string describe(const Refusal& refusal, const config::Robot& robot);

/// Tolerance of a goal outside the limits of its arm, m or rad: rounding.
inline constexpr double kGoalOutside = 1e-9;

/** State of an arm, as far as permissions depend on it. */
struct ArmCondition {
  safety::OperatingState wanted{};  ///< by control
  safety::OperatingState drives{};
  bool pending = false;  ///< power is requested; the drives do not show it yet
  bool valid = false;    ///< joints are measured
  bool located = false;  ///< the positions of all joints are known
  bool homed = false;    ///< located, without unhome since, and no home is running
  bool recovering = false;
  bool joints_move = false;          ///< by a motion, a jog, a withdrawal
  bool unseen = false;               ///< the requester has not received all of its faults
  safety::LimitViolation outside{};  ///< safety::readOutside()

  bool enabled() const noexcept {
    return wanted == safety::OperatingState::kEnabled && drives == safety::OperatingState::kEnabled;
  }
  bool ready() const noexcept { return enabled() && !pending && !recovering; }
  bool faulty() const noexcept {
    return wanted == safety::OperatingState::kFault || drives == safety::OperatingState::kFault;
  }
};

/** State of the robot, as far as permissions depend on it. */
struct RobotCondition {
  bool lock_step = false;
  bool tip_tasks = true;  ///< the robot has robots::Capability::kTips
  bool mismatch = false;  ///< a sender with another robot or deployment publishes commands or measurements
  bool received = false;  ///< an actuation/state has arrived
  bool followed = false;  ///< a trajectory is active, running or paused
  bool running = false;   ///< the trajectory runs
  bool operated = false;  ///< an operator or CRTK clients move it
  bool moving = false;    ///< an arm with power is moved by any source
  bool tips_known = false;
  int arm_count = 0;
  std::array<ArmCondition, safety::kMaxArms> arm{};
};

/// Condition as a client sees it: without requests of control that the drives do not show yet. @param phase  of
/// planning's reference
RobotCondition conditionOf(const config::Robot& robot,
                           const msg::ActuationState& state,
                           const msg::ControlStatus& status,
                           planning::Phase phase) noexcept;

/// Whether the action neither gives power nor moves anything.
bool isHarmless(Action action) noexcept;

/// Whether a refusal of disable or pause for msg::kAllArms concerns one arm's fault; arms without a fault obey.
bool isOfOneArm(const Refusal& refusal) noexcept;

/// Permission for an action of one arm, or of msg::kAllArms; see isOfOneArm().
Refusal judge(Action action, Requester requester, const RobotCondition& condition, int arm = msg::kAllArms) noexcept;

/// Index of an arm's action in msg::ControlPermissions::reason.
inline std::size_t permissionIndex(Action action, int arm) noexcept {
  return static_cast<std::size_t>(arm) * msg::kActionsPerArm + static_cast<std::size_t>(action);
}
/// Results of judge() for the lease owner, of each arm and Action.
void fill(const RobotCondition& condition, msg::ControlPermissions& permissions) noexcept;
/// Whether such a result is a permission.
inline bool allows(const msg::ControlPermissions& permissions, Action action, int arm) noexcept {
  return permissions.reason[permissionIndex(action, arm)] == static_cast<std::uint8_t>(Reason::kNone);
}

}  // namespace tandem::operation
