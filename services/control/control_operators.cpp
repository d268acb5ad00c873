// SPDX-License-Identifier: Apache-2.0
/** @file ControlCore: operators and CRTK clients. */
#include <algorithm>

#include "services/control/control_core.h"

namespace tandem::service {
namespace {

using safety::OperatingState;

}  // namespace

OperatorDesk::Context ControlCore::operatorContext(std::int64_t now) const noexcept {
  return {now, lease_.holder(now), &status_times_};
}

void ControlCore::onInput(const dds::TeleopInput& input, std::int64_t now) noexcept {
  operator_.take(input, operatorContext(now));
}

/// Where the tips are, as the errors of tasks will be computed. @return false where that is not known.
bool ControlCore::findTips() noexcept {
  if (state_.sequence == 0 || !tracker_->computeTips(q_, track_))
    return false;
  for (int k = 0; k < arm_count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (sensor_ && !tips_.tips().arm[i].known)
      return false;
    tip_places_[i] = sensor_ ? tips_.tips().arm[i].position : Eigen::Vector3d(track_.tip[i].pose.translation());
  }
  return true;
}

bool ControlCore::ready(int k) const noexcept {
  return arm_[k].machine.mayMove() && !arm_[k].pending && !recovering(k) && shownState(k) == OperatingState::kEnabled;
}

bool ControlCore::trajectoryRuns() const noexcept {
  return following() && static_cast<planning::Phase>(reference_.phase) == planning::Phase::kRunning;
}

/// What stands against the operator's motion now.
OperatorReason ControlCore::againstOperator() const noexcept {
  if (frames_)
    return OperatorReason::kCatheters;
  if (!operator_.engaged() && trajectoryRuns())
    return OperatorReason::kTrajectory;
  for (int k = 0; k < arm_count_; ++k) {
    if (k != operator_.arm() && k != operator_.otherArm())
      continue;
    if (!ready(k))
      return OperatorReason::kNotEnabled;
    if (arm_[k].activity != Activity::kNone)
      return OperatorReason::kJoints;
  }
  return tips_known_ ? OperatorReason::kNone : OperatorReason::kTips;
}

/// @return whether an operator moves the robot in this cycle; the tasks are set then.
bool ControlCore::operate(std::int64_t now) noexcept {
  if (!operator_.wants(operatorContext(now)))
    return false;
  if (const OperatorReason reason = againstOperator(); reason != OperatorReason::kNone) {
    operator_.stop(reason);
    return false;
  }
  operator_.step(tip_places_);
  operator_.tasks(tracker_->gains().relative, tracker_->gains().tip, tasks_);
  // A paused trajectory is over: it would lead back to where it was.
  spent_trajectory_ = reference_.trajectory_id;
  return true;
}

CrtkMotion::Scene ControlCore::scene(std::int64_t now) const noexcept {
  return {now, &base_, tips_known_ ? &tip_places_ : nullptr};
}

/// What stands against a command, in words; nullptr: nothing.
const char* ControlCore::againstCrtk(const CrtkOrder& order, std::int64_t now) const noexcept {
  const CrtkVerb& verb = verbOf(order.verb);
  const std::uint64_t holder = lease_.holder(now);
  if (holder != 0 && holder != dds::kCrtkClient)
    return "another client holds the control lease";
  if (lock_step_ && (verb.level != CrtkLevel::kMove || verb.space != CrtkSpace::kJoint))
    return "in lock-step only move_jp and move_jr are obeyed; use a deployment with clock: real_time";
  if (verb.level == CrtkLevel::kHold)
    return nullptr;
  if (frames_ && verb.space != CrtkSpace::kJoint)
    return "catheters that work together are moved by paths and by joints, not tip by tip";
  if (trajectoryRuns())
    return "a trajectory is running";
  const bool pair = order.group == kPairGroup;
  for (int k = pair ? 0 : order.group; k <= (pair ? 1 : order.group); ++k) {
    if (!ready(k))
      return "the arm is not ENABLED";
    if (!homed(k) || arm_[k].homing)
      return "the arm is not homed";
  }
  return nullptr;
}

CrtkOutcome ControlCore::crtk(const CrtkOrder& order, std::int64_t now) noexcept {
  CrtkOutcome outcome;
  outcome.verb = order.verb;
  outcome.group = order.group;
  if (const char* why = againstCrtk(order, now))
    return outcome.refuse("%s", why);
  readPositions();
  tips_known_ = findTips();
  const CrtkVerb& verb = verbOf(order.verb);
  const bool goal_of_joints = verb.level == CrtkLevel::kMove && verb.space == CrtkSpace::kJoint;
  if (goal_of_joints ? !moveByCrtk(order, outcome) : !crtk_.take(order, scene(now), outcome))
    return outcome;
  outcome.accepted = true;
  const bool pair = order.group == kPairGroup;
  for (int k = pair ? 0 : order.group; !goal_of_joints && k <= (pair ? 1 : order.group); ++k)
    arm_[k].activity = Activity::kNone;
  spent_trajectory_ = reference_.trajectory_id;
  if (verb.level != CrtkLevel::kHold)
    lease_.acquire(dds::kCrtkClient, now);
  return outcome;
}

/// move_jp and move_jr: one goal for the joints of an arm, or of both.
bool ControlCore::moveByCrtk(const CrtkOrder& order, CrtkOutcome& outcome) noexcept {
  const bool pair = order.group == kPairGroup;
  const int first = pair ? 0 : order.group, last = pair ? 1 : order.group;
  std::array<safety::ArmVector, 2> goals;
  for (int k = first, from = 0; k <= last; from += robot_.size(k), ++k) {
    safety::ArmVector& goal = goals[static_cast<std::size_t>(k - first)];
    goal = safety::ArmVector::Map(order.values.data() + from, robot_.size(k));
    if (verbOf(order.verb).kind == CrtkKind::kRelative)
      goal += base(k);
    const double outside = safety::largestViolation(*robot_.limits()[static_cast<std::size_t>(k)], goal);
    if (outside > 1e-9) {
      outcome.refuse("the goal is %.4g mm or mrad outside of the limits of its arm", 1e3 * outside);
      return false;
    }
  }
  for (int k = first; k <= last; ++k) {
    crtk_.end(k);
    spent_trajectory_ = reference_.trajectory_id;
    startMotion(k, goals[static_cast<std::size_t>(k - first)]);
    arm_[k].motion_verb = static_cast<std::uint8_t>(order.verb);
    arm_[k].motion_group = static_cast<std::uint8_t>(order.group);
  }
  return true;
}

/// @return whether CRTK clients move tips in this cycle; the tasks are set then.
bool ControlCore::obeyCrtk(std::int64_t now) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    const bool moved = crtk_.movesTip(k) || crtk_.movesJoints(k);
    if (moved && (!ready(k) || arm_[k].activity != Activity::kNone))
      crtk_.end(k);
  }
  if (crtk_.movesTips() && !tips_known_) {
    for (int k = 0; k < arm_count_; ++k) {
      if (crtk_.movesTip(k))
        crtk_.end(k);
    }
  }
  for (CrtkOutcome outcome; !crtk_.settle(scene(now), outcome);)
    crtk_ended_.push(outcome);
  bool moving = crtk_.active();
  for (int k = 0; k < arm_count_; ++k)
    moving = moving || (arm_[k].activity == Activity::kMotion && arm_[k].motion_verb != CrtkMoment::kNone);
  if (moving) {
    lease_.acquire(dds::kCrtkClient, now);
  } else {
    lease_.release(dds::kCrtkClient, now);
  }
  if (!crtk_.movesTips())
    return false;
  crtk_.step(scene(now), tracker_->gains(), tasks_);
  return true;
}

/// Where limits are in the way, tips do not go straight to their targets: what this cycle's velocities, and those that
/// are under way, would do to the tips must not lead into a forbidden region either. All joints slow down together.
void ControlCore::keepOut() noexcept {
  constexpr double kReaction = 0.02;  // s, of the drives
  const auto& guard = setup_.deployment.teleoperation.options.guard;
  const auto in_flight = static_cast<double>(std::min<std::uint64_t>(command_sequence_ - state_.answers_command, 10));
  const double ahead = (in_flight + 2.0) * period_ + kReaction;
  double share = 1.0;
  for (std::size_t r = 0; r < guard.forbidden.size(); ++r) {
    for (int k = 0; k < arm_count_; ++k) {
      const Eigen::Vector3d from = tip_places_[static_cast<std::size_t>(k)];
      const Eigen::Vector3d way = ahead * (track_.tip[static_cast<std::size_t>(k)].jacobian.topRows<3>() *
                                           velocity_.segment(robot_.offset(k), robot_.size(k)));
      const double here = distance(guard.forbidden[r], from);
      const double bound = std::min(0.25 * guard.margin, here) - 1e-9;
      const auto clear = [&](double part) {
        return nearestOnWay(guard.forbidden[r], from, from + part * way) >= bound;
      };
      if (here - way.norm() >= bound || clear(share))
        continue;
      kept_out_of_ = static_cast<int>(r);
      double good = 0.0, bad = share;
      for (int round = 0; round < 12; ++round) {
        const double middle = 0.5 * (good + bad);
        (clear(middle) ? good : bad) = middle;
      }
      share = good;
    }
  }
  if (share < 1.0)
    velocity_ *= share;
}

void ControlCore::fillMoments(std::int64_t now, OperatorMoment& op, CrtkMoment& crtk) const noexcept {
  operator_.fill(operatorContext(now), op);
  if (kept_out_of_ >= 0 && op.engaged) {
    auto& fixture = op.stages[static_cast<std::size_t>(planning::teleoperation::Stage::kFixture)];
    fixture.limiter = planning::teleoperation::Limiter::kForbiddenRegion;
    fixture.index = kept_out_of_;
  }
  crtk = {};
  crtk_.fill(crtk);
  crtk.commanding = lease_.holder(now) == dds::kCrtkClient;
  const bool follows = following();
  for (int k = 0; k < arm_count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    Eigen::Vector3d::Map(op.tip_target.data() + 3 * k) = tip_places_[i];
    if (arm_[k].activity == Activity::kMotion) {
      crtk.has_js[i] = 1;
      for (int j = 0; j < robot_.size(k); ++j)
        crtk.js[dds::jointIndex(k, j)] = arm_[k].motion.goal()[j];
      if (arm_[k].motion_verb != CrtkMoment::kNone)
        crtk.active[arm_[k].motion_group] = arm_[k].motion_verb;
    }
  }
  const bool operated = source_ == dds::Source::kTeleoperation || source_ == dds::Source::kCrtk;
  for (int t = 0; (operated || follows) && t < tasks_.task_count; ++t) {
    const planning::TaskReference& task = tasks_.tasks[static_cast<std::size_t>(t)];
    if (task.kind == planning::TaskKind::kTipPosition)
      Eigen::Vector3d::Map(op.tip_target.data() + 3 * task.arm) = task.position;
    const int group = task.kind == planning::TaskKind::kTipPosition ? task.arm : kPairGroup;
    const bool of_pair = group != kPairGroup || (task.arm == 0 && task.other_arm == 1);
    if (source_ == dds::Source::kCrtk || !of_pair)
      continue;  // CRTK's own goals are there already
    crtk.has_cp[static_cast<std::size_t>(group)] = 1;
    Eigen::Vector3d::Map(crtk.cp[static_cast<std::size_t>(group)].data()) = task.position;
  }
  // A relative task says where the other tip goes once the first one is known.
  for (int t = 0; operated && t < tasks_.task_count; ++t) {
    const planning::TaskReference& task = tasks_.tasks[static_cast<std::size_t>(t)];
    if (task.kind != planning::TaskKind::kRelativePosition)
      continue;
    const bool other_is_named = std::any_of(
        tasks_.tasks.begin(), tasks_.tasks.begin() + tasks_.task_count,
        [&](const auto& u) { return u.kind == planning::TaskKind::kTipPosition && u.arm == task.other_arm; });
    const auto place = [&](int k) { return Eigen::Vector3d::Map(op.tip_target.data() + 3 * k); };
    if (other_is_named)
      place(task.arm) = place(task.other_arm) + task.position;
    else
      place(task.other_arm) = place(task.arm) - task.position;
  }
}

}  // namespace tandem::service
