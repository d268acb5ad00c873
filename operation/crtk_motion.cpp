// SPDX-License-Identifier: Apache-2.0
#include "operation/crtk_motion.h"

#include <algorithm>

#include "idl/messages.h"

namespace tandem::operation {
namespace {

namespace teleoperation = planning::teleoperation;
using Eigen::Vector3d;
using kinematics::TaskPlace;

constexpr double kMotionTimeout = 3.0;  ///< a motion without progress for this time ends, s

double since(std::int64_t then, std::int64_t now) noexcept { return 1e-9 * static_cast<double>(now - then); }

}  // namespace

CrtkMotion::CrtkMotion(const ControlSetup& setup)
    : robot_(setup.model),
      servo_budget_(std::max(setup.deployment.budgets.teleoperation, 2.5 * setup.period())),
      interpolate_budget_(std::max(setup.deployment.budgets.planning_reference, 2.5 * setup.period())) {
  for (int group = 0; group < kCrtkGroups; ++group)
    groups_.emplace_back(setup, group == kPairGroup);
  for (int k = 0; k < setup.arms(); ++k)
    joints_.emplace_back(setup, k);
}

bool CrtkMotion::active() const noexcept {
  return std::any_of(groups_.begin(), groups_.end(), [](const Group& g) { return g.verb >= 0; });
}

bool CrtkMotion::movesTips() const noexcept {
  return std::any_of(groups_.begin(), groups_.end(), [](const Group& g) { return g.verb >= 0 && g.cartesian; });
}

bool CrtkMotion::movesTip(int arm) const noexcept {
  const Group& own = groups_[at(arm)];
  return (own.verb >= 0 && own.cartesian) || (arm < 2 && groups_[kPairGroup].verb >= 0);
}

std::uint8_t CrtkMotion::verb(int group) const noexcept {
  for (const Group& g : groups_) {
    if (g.verb >= 0 && g.requested_group == group)
      return static_cast<std::uint8_t>(g.verb);
  }
  return CrtkSnapshot::kNone;
}

bool CrtkMotion::busy(int arm) const noexcept {
  const auto moves = [](const Group& g) { return g.verb >= 0 && verbOf(g.verb).level == CrtkLevel::kMove; };
  return moves(groups_[at(arm)]) || (arm < 2 && moves(groups_[kPairGroup]));
}

void CrtkMotion::end(int arm) noexcept {
  groups_[at(arm)].verb = -1;
  if (arm < 2)
    groups_[kPairGroup].verb = -1;
}

void CrtkMotion::endAll() noexcept {
  for (Group& group : groups_)
    group.verb = -1;
}

bool CrtkMotion::take(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept {
  const CrtkVerb& verb = verbOf(request.verb);
  if (verb.level == CrtkLevel::kHold) {
    for (int k = request.firstArm(); k <= request.lastArm(); ++k)
      end(k);
    return true;
  }
  return verb.space == CrtkSpace::kCartesian ? takeTip(request, scene, outcome) : takeJoints(request, scene, outcome);
}

/// Of the pair only the position.
TaskPlace CrtkMotion::driven(int group, const Scene& scene) const noexcept {
  const auto& tips = *scene.tips;
  if (group != kPairGroup)
    return tips[at(group)];
  return {tips[0].position - tips[1].position, Eigen::Quaterniond::Identity()};
}

/// Tasks of the other groups.
int CrtkMotion::tasksBeside(int group) const noexcept {
  int tasks = 0;
  for (int index = 0; index < kCrtkGroups; ++index) {
    if (index != group && groups_[at(index)].verb >= 0 && groups_[at(index)].cartesian)
      tasks += groups_[at(index)].motion.tasks();
  }
  return tasks;
}

bool CrtkMotion::takeTip(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept {
  if (scene.tips == nullptr) {
    outcome.refuse("tip pose unknown: no joint or tip measurement, or the model has no solution at these joints");
    return false;
  }
  Group& group = groups_[at(request.group)];
  const bool running = group.verb >= 0 && group.cartesian;
  const TaskPlace x = driven(request.group, scene);
  const TaskPlace setpoint = running ? group.motion.target() : x;
  if (!group.motion.admits(request, setpoint, outcome))
    return false;
  if (tasksBeside(request.group) + group.motion.tasks() > planning::kMaxTasks) {
    outcome.refuse("at most %d tips, or tips and orientations, move at once; end another motion first",
                   planning::kMaxTasks);
    return false;
  }
  // The pair and the tip of its second arm are mutually exclusive.
  if (request.group == kPairGroup)
    groups_[1].verb = -1;
  if (request.group == 1)
    groups_[kPairGroup].verb = -1;
  if (request.group == kPairGroup && !groups_[0].cartesian)
    groups_[0].verb = -1;
  if (!running) {
    group.motion.start(x);
    group.held = (*scene.tips)[0].position;
  }
  group.motion.take(request, setpoint, scene.now);
  group.verb = request.verb;
  group.requested_group = request.group;
  group.cartesian = true;
  group.fed = scene.now;
  return true;
}

bool CrtkMotion::takeJoints(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept {
  std::array<safety::ArmVector, 2> goals;
  const double* value = request.values.data();
  for (int k = request.firstArm(); k <= request.lastArm(); value += robot_.size(k), ++k) {
    const bool following = movesJoints(k) && verbOf(groups_[at(k)].verb).kind != CrtkKind::kVelocity;
    if (!joints_[at(k)].goalOf(verbOf(request.verb), safety::ArmVector::Map(value, robot_.size(k)), here(k, scene),
                               following, goals[at(k - request.firstArm())], outcome))
      return false;
  }
  for (int k = request.firstArm(); k <= request.lastArm(); ++k) {
    joints_[at(k)].take(goals[at(k - request.firstArm())], !movesJoints(k));
    end(k);
    Group& group = groups_[at(k)];
    group.verb = request.verb;
    group.requested_group = request.group;
    group.cartesian = false;
    group.fed = scene.now;
  }
  return true;
}

/// Reason for the end of a motion, for people; nullptr if it reached its goal.
const char* CrtkMotion::ending(Group& group, int index, const Scene& scene, bool& over) noexcept {
  const CrtkVerb& verb = verbOf(group.verb);
  const double silence = since(group.fed, scene.now);
  over = false;
  if (verb.level != CrtkLevel::kMove) {
    const bool to_goal = verb.level == CrtkLevel::kInterpolate && verb.kind != CrtkKind::kVelocity;
    over = silence > (to_goal ? interpolate_budget_ : servo_budget_);
    return "no sample of the stream within its time budget; stopped";
  }
  if (scene.tips == nullptr) {
    over = true;
    return "tip pose lost; stopped";
  }
  const bool reached = group.motion.reached(driven(index, scene), scene.now);
  over = reached || since(group.motion.nearerAt(), scene.now) > kMotionTimeout;
  return reached ? nullptr : "no progress toward the goal (limits, a forbidden region or the workspace); motion ended";
}

bool CrtkMotion::reportEnd(const Scene& scene, CrtkOutcome& outcome) noexcept {
  for (int index = 0; index < kCrtkGroups; ++index) {
    Group& group = groups_[at(index)];
    if (group.verb < 0)
      continue;
    bool over = false;
    const char* why = ending(group, index, scene, over);
    if (!over)
      continue;
    outcome = {};
    outcome.verb = group.verb;
    outcome.group = group.requested_group;
    outcome.counts = false;
    group.verb = -1;
    if (why == nullptr)
      continue;
    outcome.refuse("%s", why);
    return false;
  }
  return true;
}

safety::ArmVector CrtkMotion::jointVelocity(int arm, const Scene& scene) noexcept {
  return joints_[at(arm)].step(verbOf(groups_[at(arm)].verb), here(arm, scene));
}

/// Tasks in the order of their priority: relative position, positions, orientations.
void CrtkMotion::step(const Scene& scene, const planning::Gains& gains, planning::Reference& reference) noexcept {
  reference.task_count = 0;
  reference.posture.resize(0);
  const auto& tips = *scene.tips;
  Group& pair = groups_[kPairGroup];
  const bool with_pair = pair.verb >= 0;
  const auto moves = [&](int k) { return groups_[at(k)].verb >= 0 && groups_[at(k)].cartesian; };
  const auto add = [&](const planning::TaskReference& task) {
    if (reference.task_count < planning::kMaxTasks)
      reference.tasks[at(reference.task_count++)] = task;
  };
  for (int k = 0; k < robot_.armCount(); ++k) {
    if (!moves(k))
      continue;
    teleoperation::DrivenTips moved;
    moved.add(k, Vector3d::Zero(), tips[at(k)].position);
    if (k == 0 && with_pair)
      moved.add(1, -pair.motion.target().position, tips[1].position);
    groups_[at(k)].motion.advance(verbOf(groups_[at(k)].verb), tips[at(k)], moved);
  }
  if (with_pair) {
    const bool led = moves(0);
    const Vector3d anchor = led ? groups_[0].motion.target().position : pair.held;
    const TaskPlace now = driven(kPairGroup, scene);
    teleoperation::DrivenTips moved;
    moved.add(1, anchor, tips[1].position, -1.0);
    pair.motion.advance(verbOf(pair.verb), now, moved);
    add(pair.motion.taskTo(planning::TaskKind::kRelativePosition, 0, pair.motion.target().position, now.position,
                           gains.relative));
    if (!led)
      add(pair.motion.taskTo(planning::TaskKind::kTipPosition, 0, pair.held, tips[0].position, gains.tip));
  }
  for (int k = 0; k < robot_.armCount(); ++k) {
    const CartesianMotion& motion = groups_[at(k)].motion;
    if (moves(k))
      add(motion.taskTo(planning::TaskKind::kTipPosition, k, motion.target().position, tips[at(k)].position,
                        gains.tip));
  }
  for (int k = 0; k < robot_.armCount(); ++k) {
    if (moves(k) && groups_[at(k)].motion.rotates())
      add(groups_[at(k)].motion.orientationTask(k, tips[at(k)].orientation, gains.tip));
  }
}

void CrtkMotion::fill(CrtkSnapshot& snapshot) const noexcept {
  for (int index = 0; index < kCrtkGroups; ++index) {
    const Group& group = groups_[at(index)];
    snapshot.active[at(index)] = verb(index);
    if (group.verb < 0 || verbOf(group.verb).level == CrtkLevel::kServo)
      continue;
    if (group.cartesian) {
      group.motion.fill(verbOf(group.verb), at(index), snapshot);
    } else if (verbOf(group.verb).kind != CrtkKind::kVelocity) {
      snapshot.has_js[at(index)] = 1;
      for (int j = 0; j < robot_.size(index); ++j)
        snapshot.js[msg::jointIndex(index, j)] = joints_[at(index)].goal()[j];
    }
  }
}

}  // namespace tandem::operation
