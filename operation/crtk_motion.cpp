// SPDX-License-Identifier: Apache-2.0
#include "operation/crtk_motion.h"

#include <algorithm>
#include <limits>

#include "idl/messages.h"
#include "operation/smooth_motion.h"

namespace tandem::operation {
namespace {

namespace teleoperation = planning::teleoperation;
using Eigen::Vector3d;

constexpr double kThere = 5e-5;         ///< distance at which a tip has reached its goal, m
constexpr double kNearer = 1e-5;        ///< smallest decrease of the distance that counts as progress, m
constexpr double kMotionTimeout = 3.0;  ///< a motion without progress for this time ends, s

double since(std::int64_t then, std::int64_t now) noexcept { return 1e-9 * static_cast<double>(now - then); }

}  // namespace

CrtkMotion::CrtkMotion(const ControlSetup& setup)
    : robot_(setup.model),
      guard_(setup.deployment.teleoperation.options.guard),
      options_(setup.deployment.teleoperation.crtk),
      period_(setup.period()),
      response_(teleoperation::responseTime(guard_, period_)),
      leash_(teleoperation::leashOf(guard_, period_)),
      servo_budget_(std::max(setup.deployment.budgets.teleoperation, 2.5 * period_)),
      interpolate_budget_(std::max(setup.deployment.budgets.planning_reference, 2.5 * period_)),
      groups_(kCrtkGroups, Group(guard_)) {
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

Vector3d CrtkMotion::driven(int group, const Scene& scene) const noexcept {
  const auto& tips = *scene.tips;
  return group == kPairGroup ? Vector3d(tips[0] - tips[1]) : tips[at(group)];
}

bool CrtkMotion::takeTip(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept {
  const CrtkVerb& verb = verbOf(request.verb);
  if (scene.tips == nullptr) {
    outcome.refuse("tip pose unknown: no joint or tip measurement, or the model has no solution at these joints");
    return false;
  }
  Group& group = groups_[at(request.group)];
  const bool running = group.verb >= 0 && group.cartesian;
  const Vector3d x = driven(request.group, scene);
  const Vector3d setpoint = running ? group.guard.target() : x;
  const Vector3d value = Vector3d::Map(request.values.data());
  const Vector3d goal = verb.kind == CrtkKind::kRelative ? Vector3d(setpoint + value) : value;
  const double step = (goal - setpoint).norm();
  if (verb.level == CrtkLevel::kServo && verb.kind != CrtkKind::kVelocity && step > options_.tip_step) {
    outcome.refuse(
        "found a step of %.3f mm from the last goal, expected at most %.3f mm (tip_step); use interpolate or move",
        1e3 * step, 1e3 * options_.tip_step);
    return false;
  }
  int tasks = 0;  // of the other groups; the pair needs two
  for (int index = 0; index < kCrtkGroups; ++index) {
    if (index != request.group && groups_[at(index)].verb >= 0 && groups_[at(index)].cartesian)
      tasks += index == kPairGroup ? 2 : 1;
  }
  if (tasks + (request.group == kPairGroup ? 2 : 1) > planning::kMaxTasks) {
    outcome.refuse("at most %d tips move at once; end another motion first", planning::kMaxTasks);
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
    group.guard.engage(x);
    group.speed.setZero();
    group.held = (*scene.tips)[0];
  }
  group.verb = request.verb;
  group.requested_group = request.group;
  group.cartesian = true;
  group.fed = group.nearer_at = scene.now;
  group.goal = goal;
  group.asked = value;
  group.nearest = std::numeric_limits<double>::infinity();
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
const char* CrtkMotion::ending(const Group& group, int index, const Scene& scene, bool& over) noexcept {
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
  const double away = (group.goal - driven(index, scene)).norm();
  Group& noted = groups_[at(index)];
  if (away < group.nearest - kNearer) {
    noted.nearest = away;
    noted.nearer_at = scene.now;
  }
  over = away <= kThere || since(group.nearer_at, scene.now) > kMotionTimeout;
  return away <= kThere ? nullptr
                        : "no progress toward the goal (limits, a forbidden region or the workspace); motion ended";
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

/// Target of a tip after this period, before the guard.
Vector3d CrtkMotion::wanted(Group& group) const noexcept {
  const CrtkVerb& verb = verbOf(group.verb);
  const Vector3d& target = group.guard.target();
  if (verb.level == CrtkLevel::kServo)
    return verb.kind == CrtkKind::kVelocity ? Vector3d(target + period_ * group.asked) : group.goal;
  const Vector3d every = Vector3d::Constant(options_.acceleration);
  if (verb.kind == CrtkKind::kVelocity) {
    group.speed = rampedVelocity(group.asked, group.speed, every, period_);
  } else {
    const Vector3d displacement = group.goal - target;
    const double length = displacement.norm();
    const Vector3d share = length > 0.0 ? Vector3d(displacement.cwiseAbs() / length) : Vector3d(Vector3d::Zero());
    const Vector3d acceleration = options_.acceleration * share.cwiseMax(0.1);
    group.speed = smoothVelocity(displacement, group.speed, Vector3d(guard_.max_speed * share), acceleration, period_);
  }
  return target + period_ * group.speed;
}

void CrtkMotion::step(const Scene& scene, const planning::Gains& gains, planning::Reference& reference) noexcept {
  reference.task_count = 0;
  reference.posture.resize(0);
  const auto& tips = *scene.tips;
  Group& pair = groups_[kPairGroup];
  const bool with_pair = pair.verb >= 0;
  const auto advance = [&](Group& group, const Vector3d& now, const teleoperation::DrivenTips& moved) {
    const Vector3d before = group.guard.target();
    group.guard.step(wanted(group), now, moved, leash_, period_);
    group.speed = (group.guard.target() - before) / period_;
  };
  const auto add = [&](planning::TaskKind kind, int arm, const Vector3d& target, const Vector3d& now, double gain) {
    if (reference.task_count < planning::kMaxTasks) {
      reference.tasks[at(reference.task_count++)] = {kind, arm, 1, target,
                                                     std::max(0.0, 1.0 / response_ - gain) * (target - now)};
    }
  };
  for (int k = 0; k < robot_.armCount(); ++k) {
    Group& group = groups_[at(k)];
    if (group.verb < 0 || !group.cartesian)
      continue;
    teleoperation::DrivenTips moved;
    moved.add(k, Vector3d::Zero(), tips[at(k)]);
    if (k == 0 && with_pair)
      moved.add(1, -pair.guard.target(), tips[1]);
    advance(group, tips[at(k)], moved);
  }
  if (with_pair) {
    const bool led = groups_[0].verb >= 0 && groups_[0].cartesian;
    const Vector3d anchor = led ? groups_[0].guard.target() : pair.held;
    teleoperation::DrivenTips moved;
    moved.add(1, anchor, tips[1], -1.0);
    advance(pair, tips[0] - tips[1], moved);
    add(planning::TaskKind::kRelativePosition, 0, pair.guard.target(), tips[0] - tips[1], gains.relative);
    if (!led)
      add(planning::TaskKind::kTipPosition, 0, pair.held, tips[0], gains.tip);
  }
  for (int k = 0; k < robot_.armCount(); ++k) {
    const Group& group = groups_[at(k)];
    if (group.verb >= 0 && group.cartesian)
      add(planning::TaskKind::kTipPosition, k, group.guard.target(), tips[at(k)], gains.tip);
  }
}

void CrtkMotion::fill(CrtkSnapshot& snapshot) const noexcept {
  for (int index = 0; index < kCrtkGroups; ++index) {
    const Group& group = groups_[at(index)];
    snapshot.active[at(index)] = verb(index);
    if (group.verb < 0 || verbOf(group.verb).level == CrtkLevel::kServo)
      continue;
    const bool velocity = verbOf(group.verb).kind == CrtkKind::kVelocity;
    if (group.cartesian) {
      (velocity ? snapshot.has_cv : snapshot.has_cp)[at(index)] = 1;
      Vector3d::Map((velocity ? snapshot.cv : snapshot.cp)[at(index)].data()) = velocity ? group.asked : group.goal;
    } else if (!velocity) {
      snapshot.has_js[at(index)] = 1;
      for (int j = 0; j < robot_.size(index); ++j)
        snapshot.js[msg::jointIndex(index, j)] = joints_[at(index)].goal()[j];
    }
  }
}

}  // namespace tandem::operation
