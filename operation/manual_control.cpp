// SPDX-License-Identifier: Apache-2.0
#include "operation/manual_control.h"

#include <algorithm>

namespace tandem::operation {

using msg::Source;
using planning::TaskKind;

ManualControl::ManualControl(const ControlSetup& setup, const DriveExchange& drives)
    : setup_(setup), drives_(drives), operator_(setup), crtk_(setup) {}

Source ManualControl::choose(const OperatorInputHandler::Context& context,
                             const RobotCondition& condition,
                             const planning::Gains& gains,
                             planning::Reference& tasks,
                             CrtkEndings& endings) noexcept {
  kept_out_of_ = -1;
  endings.count = 0;
  if (operate(context, condition)) {
    operator_.tasks(gains.relative, gains.tip, tasks);
    crtk_.endAll();
    return Source::kTeleoperation;
  }
  finishCrtkMotions(condition, context.now, endings);
  if (!crtk_.movesTips())
    return Source::kNobody;
  crtk_.step(scene(context.now), gains, tasks);
  return Source::kCrtk;
}

bool ManualControl::operate(const OperatorInputHandler::Context& context, const RobotCondition& condition) noexcept {
  if (!operator_.isActive(context))
    return false;
  for (const int arm : {operator_.arm(), operator_.otherArm()}) {
    if (const Refusal refusal = judge(Action::kTeleoperate, Requester::kLeaseOwner, condition, arm)) {
      operator_.stop(refusal.reason);
      return false;
    }
  }
  operator_.step(tips_);
  return true;
}

void ManualControl::finishCrtkMotions(const RobotCondition& condition,
                                      std::int64_t now,
                                      CrtkEndings& endings) noexcept {
  for (int k = 0; k < setup_.arms(); ++k) {
    const ArmCondition& arm = condition.arm[static_cast<std::size_t>(k)];
    const bool tip = crtk_.movesTip(k);
    if (((tip || crtk_.movesJoints(k)) && (!arm.ready() || arm.joints_move)) || (tip && !tips_known_))
      crtk_.end(k);
  }
  while (!crtk_.reportEnd(scene(now), endings.outcome[static_cast<std::size_t>(endings.count)]))
    ++endings.count;
}

void ManualControl::invalidateTips() noexcept {
  operator_.stop(Reason::kTips);
  crtk_.endAll();
}

void ManualControl::keepOut(const planning::TrackResult& result, safety::RobotVector& velocity) noexcept {
  constexpr double kReaction = 0.02;  // s, of the drives
  const auto& guard = setup_.deployment.teleoperation.options.guard;
  const auto in_flight = static_cast<double>(std::min<std::uint64_t>(drives_.inFlight(), 10));
  const double ahead = (in_flight + 2.0) * setup_.period() + kReaction;
  double share = 1.0;
  for (std::size_t r = 0; r < guard.forbidden.size(); ++r) {
    for (int k = 0; k < setup_.arms(); ++k) {
      const Eigen::Vector3d from = tips_[static_cast<std::size_t>(k)].position;
      const Eigen::Vector3d displacement =
          ahead * (result.tip[static_cast<std::size_t>(k)].jacobian.topRows<3>() * setup_.of(k, velocity));
      const double here = distance(guard.forbidden[r], from);
      const double bound = std::min(0.25 * guard.margin, here) - 1e-9;
      const auto clear = [&](double part) {
        return nearestOnWay(guard.forbidden[r], from, from + part * displacement) >= bound;
      };
      if (here - displacement.norm() >= bound || clear(share))
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
    velocity *= share;
}

void ManualControl::fill(const OperatorInputHandler::Context& context,
                         Source source,
                         const planning::Reference* tasks,
                         OperatorSnapshot& op,
                         CrtkSnapshot& crtk) const noexcept {
  operator_.fill(context, op);
  if (kept_out_of_ >= 0 && op.engaged) {
    auto& fixture = op.stages[static_cast<std::size_t>(planning::teleoperation::Stage::kFixture)];
    fixture.limiter = planning::teleoperation::Limiter::kForbiddenRegion;
    fixture.index = kept_out_of_;
  }
  crtk = {};
  crtk_.fill(crtk);
  crtk.commanding = context.lease_owner == msg::kCrtkClient;
  for (int k = 0; k < setup_.arms(); ++k)
    Eigen::Vector3d::Map(op.tip_target.data() + 3 * k) = tips_[static_cast<std::size_t>(k)].position;
  for (int t = 0; tasks != nullptr && t < tasks->task_count; ++t) {
    const planning::TaskReference& task = tasks->tasks[static_cast<std::size_t>(t)];
    const bool of_tip = task.kind == TaskKind::kTipPosition;
    if (task.kind == TaskKind::kTipOrientation && source != Source::kCrtk)
      Eigen::Vector4d::Map(crtk.cp_orientation[static_cast<std::size_t>(task.arm)].data()) = task.orientation.coeffs();
    if (!of_tip && task.kind != TaskKind::kRelativePosition)
      continue;
    if (of_tip)
      Eigen::Vector3d::Map(op.tip_target.data() + 3 * task.arm) = task.position;
    if (source == Source::kCrtk || (!of_tip && (task.arm != 0 || task.other_arm != 1)))
      continue;  // CRTK's own goals are already written
    const auto group = static_cast<std::size_t>(of_tip ? task.arm : kPairGroup);
    crtk.has_cp[group] = 1;
    Eigen::Vector3d::Map(crtk.cp[group].data()) = task.position;
  }
  if (source == Source::kTeleoperation || source == Source::kCrtk)
    fillTargets(*tasks, op);
}

/// A relative task defines the target of the other tip once the first one is known.
void ManualControl::fillTargets(const planning::Reference& tasks, OperatorSnapshot& op) const noexcept {
  const auto place = [&](int k) { return Eigen::Vector3d::Map(op.tip_target.data() + 3 * k); };
  const auto end = tasks.tasks.begin() + tasks.task_count;
  for (auto task = tasks.tasks.begin(); task != end; ++task) {
    if (task->kind != TaskKind::kRelativePosition)
      continue;
    const bool other_is_named = std::any_of(tasks.tasks.begin(), end, [&](const auto& u) {
      return u.kind == TaskKind::kTipPosition && u.arm == task->other_arm;
    });
    if (other_is_named)
      place(task->arm) = place(task->other_arm) + task->position;
    else
      place(task->other_arm) = place(task->arm) - task->position;
  }
}

}  // namespace tandem::operation
