// SPDX-License-Identifier: Apache-2.0
/** @file judge() as the only source of permissions, compared with the behaviour of control. */
#include "operation/permission.h"

#include <gtest/gtest.h>

#include <set>

#include "operation/control_core.h"
#include "tests/unit/operation/rig.h"

namespace tandem::test {
namespace {

using namespace operation;
using safety::OperatingState;

RobotCondition randomCondition(Random& random) {
  const auto often = [&] { return random.chance(0.7); };
  const auto rarely = [&] { return random.chance(0.2); };
  const auto state = [&] { return static_cast<OperatingState>(random.integer(0, 3)); };
  RobotCondition now{
      rarely(), rarely(), rarely(), often(), rarely(), rarely(), rarely(), rarely(), often(), random.integer(1, 8), {}};
  for (ArmCondition& arm : now.arm) {
    const OperatingState wanted = state();
    arm = {wanted,   often() ? wanted : state(),
           rarely(), often(),
           often(),  often(),
           rarely(), rarely(),
           false,    {random.integer(0, 5), random.uniform(-1e-3, 1e-3)}};
  }
  return now;
}

bool takesAway(Action action) { return action == Action::kDisable || action == Action::kPause; }

TEST(Permission, OnlyTheLeaseOwnerGivesPowerAndEveryClientMayRemoveIt) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(2000); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const RobotCondition now = randomCondition(random);
    const int arm = random.integer(0, now.arm_count - 1);
    for (int i = 0; i < kActions; ++i) {
      const auto action = static_cast<Action>(i);
      const Refusal own = judge(action, Requester::kLeaseOwner, now, arm);
      for (const Requester requester : {Requester::kNoLeaseOwner, Requester::kOtherClient}) {
        const Refusal foreign = judge(action, requester, now, arm);
        EXPECT_TRUE(foreign || !own) << i << ": who does not command may not do more";
        const bool free =
            takesAway(action) || (action == Action::kAcquireLease && requester == Requester::kNoLeaseOwner);
        EXPECT_EQ(static_cast<bool>(foreign),
                  !free || own || (takesAway(action) && now.arm[static_cast<std::size_t>(arm)].faulty()))
            << i;
      }
      // A request for all arms is refused if it is refused for one.
      bool any = false;
      for (int k = 0; k < now.arm_count; ++k)
        any = any || judge(action, Requester::kLeaseOwner, now, k);
      EXPECT_EQ(static_cast<bool>(judge(action, Requester::kLeaseOwner, now)), any) << i;
    }
    EXPECT_FALSE(judge(Action::kDisable, Requester::kLeaseOwner, now)) << "there is always this way out";
  }
}

TEST(Permission, NothingIsPermittedBeforeTheFirstState) {
  EXPECT_EQ(judge(Action::kStart, Requester::kNoLeaseOwner, RobotCondition{}).reason, Reason::kNoLease);
  EXPECT_EQ(judge(Action::kStart, Requester::kOtherClient, RobotCondition{}).reason, Reason::kOtherLease);
  EXPECT_EQ(judge(Action::kEnable, Requester::kLeaseOwner, RobotCondition{}).reason, Reason::kNoState);
}

TEST(Permission, EachRefusalSaysSomethingOfItsOwn) {
  std::set<std::string> said;
  for (int i = 1; i < idl::count<Reason>; ++i)
    said.emplace(name(static_cast<Reason>(i)));
  EXPECT_EQ(said.count(""), 0u);
  EXPECT_EQ(said.size(), static_cast<std::size_t>(idl::count<Reason>) - 2) << "a lease taken and another's are alike";
  EXPECT_EQ(name(Reason::kNone), "");
}

/** Control, and drives that often follow its requests. */
struct Walk {
  Rig rig;
  Random random;
  Drives drives{rig};
  ControlCore core{rig.setup(), rig.tracker()};
  CycleOutput output;
  msg::PlanningReference reference;
  std::int64_t now = kSecond;

  explicit Walk(std::uint32_t seed) : random(seed) {}

  void step() {
    now += random.chance(0.02) ? 2 * kSecond : rig.period();
    if (random.chance(0.9))
      drives.take(output.command);
    disturb();
    core.onState(drives.state);
    if (random.chance(0.3)) {
      reference.state_session = kDriveSession;
      reference.answers_control = output.status.sequence;
      reference.phase = static_cast<std::uint8_t>(random.chance(0.6) ? 0 : random.integer(1, 4));
      reference.trajectory_id += random.chance(0.3) ? 1 : 0;
      reference.task_count = 1;
      reference.tasks[0].kind = static_cast<std::uint8_t>(planning::TaskKind::kTipPosition);
      reference.tasks[0].position = {0.0, 0.0, 0.2};
      core.onReference(reference);
    }
    if (random.chance(0.005))
      core.stop();
    core.cycle(now, false, output);
  }
  void disturb() {
    const auto k = static_cast<std::size_t>(random.integer(0, 1));
    if (random.chance(0.005))
      drives.state.operating_state[k] = static_cast<std::uint8_t>(random.integer(0, 3));
    if (random.chance(drives.state.faults[k] != 0 ? 0.2 : 0.003))
      drives.state.faults[k] ^= bit(safety::Fault::kDrive);
    if (random.chance(drives.state.homed[k] == 0 ? 0.2 : 0.01))
      drives.state.homed[k] ^= 1;
    if (random.chance(drives.state.valid[k] == 0 ? 0.2 : 0.003))
      drives.state.valid[k] ^= 1;
    if (random.chance(0.02))
      drives.place(static_cast<int>(k),
                   rig.robot.arms[k].home + safety::ArmVector::Constant(6, random.uniform(0, 0.02)));
    if (random.chance(0.05))
      drives.place(static_cast<int>(k), rig.robot.arms[k].home);
  }
  ParsedControlRequest request() {
    ParsedControlRequest o;
    o.client = random.chance(0.85) ? 7 : 8;
    o.kind = random.chance(0.4) ? msg::ControlKind::kStateCommand
                                : static_cast<msg::ControlKind>(random.integer(1, idl::count<msg::ControlKind>));
    o.arm = random.chance(0.4) ? msg::kAllArms : random.integer(0, 1);
    o.control_session = rig.setup().session;
    o.answers_control = output.status.sequence;
    if (o.kind == msg::ControlKind::kStateCommand && random.chance(0.3))
      o.answers_control -= std::min<std::uint64_t>(o.answers_control - 1, 20);
    if (o.kind == msg::ControlKind::kStateCommand) {
      o.from_topic = random.chance(0.2);
      o.command = static_cast<safety::StateCommand>(random.chance(0.4) ? 0 : random.integer(0, 6));
    }
    const bool one = o.kind == msg::ControlKind::kMoveJp || o.kind == msg::ControlKind::kJog;
    if (one || o.kind == msg::ControlKind::kWithdraw)
      o.arm = random.integer(0, 1);
    o.joint_count = one ? 6 : 0;
    if (o.kind == msg::ControlKind::kMoveJp)
      Eigen::VectorXd::Map(o.joints.data(), 6) = rig.robot.arms[static_cast<std::size_t>(o.arm)].home;
    if (actionOf(o) == Action::kSetMethod)
      o.tracker = rig.tracker().release();
    return o;
  }
};

msg::ControlPermissions permissionsOf(const RobotCondition& now) {
  msg::ControlPermissions permissions;
  fill(now, permissions);
  return permissions;
}

/// Checks the effect of an accepted request.
void expectEffect(Action action, const ArmCondition& arm, bool method_accepted) {
  switch (action) {
    case Action::kEnable:
    case Action::kResume:
    case Action::kRecover:
      EXPECT_EQ(arm.wanted, OperatingState::kEnabled);
      break;
    case Action::kDisable:
      EXPECT_EQ(arm.wanted, OperatingState::kDisabled);
      break;
    case Action::kPause:
      EXPECT_EQ(arm.wanted, OperatingState::kPaused);
      break;
    case Action::kUnhome:
      EXPECT_FALSE(arm.homed);
      break;
    case Action::kHome:
    case Action::kMoveJp:
    case Action::kJog:
    case Action::kWithdraw:
      EXPECT_TRUE(arm.joints_move);
      break;
    case Action::kHold:
      EXPECT_FALSE(arm.joints_move);
      break;
    case Action::kSetMethod:
      EXPECT_TRUE(method_accepted);
      break;
    default:
      break;
  }
}

TEST(Permission, RepliesOfControlMatchThePublishedPermissions) {
  std::array<int, kActions> allowed{}, refused{};
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(20); ++seed) {
    SCOPED_TRACE(trace(seed));
    Walk walk(seed);
    for (int i = 0; i < 300; ++i) {
      walk.step();
      const std::uint64_t owner = walk.output.status.lease_owner;
      const ParsedControlRequest request = walk.request();
      const RobotCondition before = walk.core.condition(), seen = walk.core.condition(request);
      const Action action = actionOf(request);
      const Requester requester = request.from_topic ? crtkRequester(owner) : requesterOf(request.client, owner);
      const Refusal expected = judge(action, requester, seen, request.arm);
      const ControlReply reply = walk.core.onRequest(request, walk.now);
      delete reply.retired;
      if (request.from_topic && reply.refusal.reason == Reason::kNoEcho)
        continue;  // the sender's knowledge is independent of the situation
      EXPECT_EQ(reply.refusal.reason, expected.reason) << static_cast<int>(action);
      (expected ? refused : allowed)[static_cast<std::size_t>(action)] += 1;
      const RobotCondition after = walk.core.condition();
      for (int k = 0; k < 2; ++k) {
        const auto arm = static_cast<std::size_t>(k);
        const auto published = walk.output.permissions.reason[permissionIndex(action, k)];
        EXPECT_EQ(published, static_cast<std::uint8_t>(judge(action, Requester::kLeaseOwner, before, k).reason));
        if (!expected && (request.arm == msg::kAllArms || request.arm == k))
          expectEffect(action, after.arm[arm], reply.method_accepted);
      }
      if (expected && !isOfOneArm(expected)) {
        EXPECT_EQ(permissionsOf(after).reason, permissionsOf(before).reason) << "what is refused changes nothing";
      }
      ASSERT_FALSE(HasFailure());
    }
  }
  for (int i = 0; i <= static_cast<int>(Action::kReleaseLease); ++i) {
    if (i == static_cast<int>(Action::kStart) || i == static_cast<int>(Action::kSteer))
      continue;  // requests to planning
    EXPECT_GT(allowed[static_cast<std::size_t>(i)], 0) << "the walks never got to see it allowed: " << i;
    EXPECT_GT(refused[static_cast<std::size_t>(i)], 0) << "the walks never got to see it refused: " << i;
  }
}

TEST(Permission, RepliesToCrtkMatchThePermissions) {
  int allowed = 0, refused = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(20); ++seed) {
    SCOPED_TRACE(trace(seed));
    Walk walk(seed);
    for (int i = 0; i < 300; ++i) {
      walk.step();
      ParsedControlRequest enable;
      enable.kind = msg::ControlKind::kStateCommand;
      enable.command = walk.random.chance(0.2) ? safety::StateCommand::kDisable : safety::StateCommand::kEnable;
      enable.from_topic = true;
      enable.control_session = walk.output.status.session;
      enable.answers_control = walk.output.status.sequence;
      walk.core.onRequest(enable, walk.now);
      CrtkRequest request;
      request.verb = walk.random.integer(0, static_cast<int>(kCrtkVerbs.size()) - 1);
      request.group = walk.random.chance(0.3) ? kPairGroup : walk.random.integer(0, 1);
      Refusal expected;
      for (int k = request.firstArm(); k <= request.lastArm() && !expected; ++k)
        expected = judge(actionOf(verbOf(request.verb)), crtkRequester(walk.output.status.lease_owner),
                         walk.core.condition(), k);
      const CrtkOutcome outcome = walk.core.crtk(request, walk.now);
      if (expected) {
        EXPECT_FALSE(outcome.accepted);
        EXPECT_EQ(outcome.reason.data(), name(expected.reason));
      }
      (expected ? refused : allowed) += 1;
    }
  }
  EXPECT_GT(allowed, 100);
  EXPECT_GT(refused, 100);
}

TEST(Permission, ClientAndControlComputeEqualPermissions) {
  int seen = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(20); ++seed) {
    SCOPED_TRACE(trace(seed));
    Walk walk(seed);
    for (int i = 0; i < 300; ++i) {
      walk.step();
      const RobotCondition of_control = walk.core.condition();
      const RobotCondition of_client = conditionOf(walk.rig.robot, walk.drives.state, walk.output.status,
                                                   static_cast<planning::Phase>(walk.reference.phase));
      for (int k = 0; k < 2; ++k) {
        const ArmCondition &own = of_control.arm[static_cast<std::size_t>(k)],
                           &arm = of_client.arm[static_cast<std::size_t>(k)];
        if (own.pending || (own.wanted != own.drives && own.wanted != OperatingState::kFault))
          continue;
        ++seen;
        EXPECT_EQ(arm.wanted, own.wanted);
        for (const safety::StateCommand command :
             {safety::StateCommand::kEnable, safety::StateCommand::kDisable, safety::StateCommand::kPause,
              safety::StateCommand::kResume, safety::StateCommand::kRecover, safety::StateCommand::kUnhome}) {
          for (const Requester requester : {Requester::kLeaseOwner, Requester::kNoLeaseOwner, Requester::kOtherClient})
            EXPECT_EQ(judge(static_cast<Action>(command), requester, of_client, k).reason,
                      judge(static_cast<Action>(command), requester, of_control, k).reason)
                << safety::name(command);
        }
      }
      const ControlReply reply = walk.core.onRequest(walk.request(), walk.now);
      delete reply.retired;
    }
  }
  EXPECT_GT(seen, 1000);
}

}  // namespace
}  // namespace tandem::test
