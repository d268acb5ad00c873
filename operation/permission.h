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

/** Who wants it. */
enum class Requester : std::uint8_t {
  kLeaseOwner = 0,  ///< holds the control lease
  kNoLeaseOwner,    ///< nobody holds it
  kOtherClient,     ///< somebody else holds it
};
/// Client 0 and msg::kCrtkClient stand for nobody.
Requester requesterOf(std::uint64_t client, std::uint64_t lease_holder) noexcept;
/// CRTK's topics know no clients: whoever writes there commands while no client does.
Requester crtkRequester(std::uint64_t lease_holder) noexcept;

using Reason = idl::RefusalReason;  ///< its name is a sentence for people, with the way out

/** An answer: no, and why. Converts to true; the default says yes. */
struct Refusal {
  Reason reason = Reason::kNone;
  Action action = Action::kHold;
  safety::OperatingState state{};    ///< kWrongState: of the arm
  std::int8_t arm = -1;              ///< that stands in the way; -1: none does
  safety::LimitViolation outside{};  ///< kOutsideLimits, kGoalOutside

  explicit operator bool() const noexcept { return reason != Reason::kNone; }
  msg::ReplyCode code() const noexcept;
};
/// The whole answer for people: the reason with arm, joint and amount where they count.
std::string describe(const Refusal& refusal, const config::Robot& robot);

/// A goal may be so far outside the limits of its arm, m or rad: rounding.
inline constexpr double kGoalOutside = 1e-9;

/** How an arm stands, as far as that decides what may be asked of it. */
struct ArmCondition {
  safety::OperatingState wanted{};  ///< by control
  safety::OperatingState drives{};
  bool pending = false;  ///< power was asked for; the drives do not show it yet
  bool valid = false;    ///< joints are measured
  bool located = false;  ///< all joints know where they are
  bool homed = false;    ///< so they do, nobody has asked to forget it, and no home is under way
  bool recovering = false;
  bool joints_move = false;          ///< by a motion, a jog, a withdrawal
  bool unseen = false;               ///< who asks has not seen all of its faults
  safety::LimitViolation outside{};  ///< safety::readOutside()

  bool enabled() const noexcept {
    return wanted == safety::OperatingState::kEnabled && drives == safety::OperatingState::kEnabled;
  }
  bool ready() const noexcept { return enabled() && !pending && !recovering; }
  bool faulty() const noexcept {
    return wanted == safety::OperatingState::kFault || drives == safety::OperatingState::kFault;
  }
};

/** How the robot stands. */
struct RobotCondition {
  bool lock_step = false;
  bool tip_tasks = true;  ///< the robot has robots::Capability::kTips
  bool mismatch = false;  ///< somebody who knows another robot or deployment commands or measures
  bool received = false;  ///< there is an actuation/state
  bool followed = false;  ///< a trajectory is under way, running or paused
  bool running = false;   ///< it runs
  bool operated = false;  ///< an operator or CRTK clients move it
  bool moving = false;    ///< an arm that has power is moved by somebody
  bool tips_known = false;
  int arm_count = 0;
  std::array<ArmCondition, safety::kMaxArms> arm{};
};

/// As a client sees it. What control has asked for and the drives do not show yet is not in it.
/// @param phase  of planning's reference
RobotCondition conditionOf(const config::Robot& robot,
                           const msg::ActuationState& state,
                           const msg::ControlStatus& status,
                           planning::Phase phase) noexcept;

/// Whether it neither gives power nor moves anything.
bool isHarmless(Action action) noexcept;

/// Of a refusal of disable or pause for msg::kAllArms: it is about a fault, and arms without one obey.
bool isOfOneArm(const Refusal& refusal) noexcept;

/// Whether somebody may do something with an arm now, or with msg::kAllArms; see isOfOneArm().
Refusal judge(Action action, Requester requester, const RobotCondition& condition, int arm = msg::kAllArms) noexcept;

/// Where the answer for an arm stands in msg::ControlPermissions::reason.
inline std::size_t permissionIndex(Action action, int arm) noexcept {
  return static_cast<std::size_t>(arm) * msg::kActionsPerArm + static_cast<std::size_t>(action);
}
/// What judge() answers the commander, of each arm and Action.
void fill(const RobotCondition& condition, msg::ControlPermissions& permissions) noexcept;
/// Whether that was yes.
inline bool allows(const msg::ControlPermissions& permissions, Action action, int arm) noexcept {
  return permissions.reason[permissionIndex(action, arm)] == static_cast<std::uint8_t>(Reason::kNone);
}

}  // namespace tandem::operation
