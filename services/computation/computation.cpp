// SPDX-License-Identifier: Apache-2.0
#include "services/computation/computation.h"

#include <algorithm>
#include <cmath>

#include "control/method_names.h"
#include "services/computation/reports.h"
#include "services/dds/validate.h"

namespace tandem::computation {
namespace {

using dds::ComputationKind;

void reportProgress(const ComputationHooks& hooks, double fraction, const std::string& at, int done, int all) {
  if (hooks.progress)
    hooks.progress(fraction, at, done, all);
}

void judge(const planning::FeasibilityReport& report, dds::ComputationResult& result) {
  result.outcome = static_cast<std::uint8_t>(report.cancelled  ? dds::Outcome::kCancelled
                                             : report.feasible ? dds::Outcome::kGood
                                                               : dds::Outcome::kNot);
  if (!report.start.empty())
    result.reason = report.start;
  else if (!report.feasible && !report.cancelled)
    result.reason = std::to_string(report.unreachable()) + " of " + std::to_string(report.points.size()) +
                    " points are not reachable";
}

/// Partial result of a cancelled check: " after 30 points, 2 of them unreachable, the first: point 29: ..."; empty:
/// nothing.
std::string progressOf(const dds::TrajectoryReport& report) {
  if (report.points.empty())
    return {};
  std::string text = " after " + std::to_string(report.points.size()) + " points, " +
                     std::to_string(unreachable(report)) + " of them unreachable";
  const auto first = std::ranges::find_if_not(report.points, reached);
  if (first != report.points.end())
    text += ", the first: point " + std::to_string(first->point) + ": " + first->reason;
  return text;
}

}  // namespace

Computation::Computation(dds::ComputationRequest request,
                         const ComputationRobot& robot,
                         const std::optional<safety::RobotVector>& present)
    : problem_(std::move(request), robot, present) {}

planning::IkOptions Computation::ik(const ComputationHooks& hooks) const {
  planning::IkOptions ik;
  // A rigid arm never snaps.
  if (!problem_.robot.rigid)
    ik.demands.stability = problem_.request.stability;
  if (problem_.request.arms_may_touch == 0 && problem_.arms.count() > 1)
    ik.demands.clearance = problem_.request.clearance;
  if (problem_.request.port_radius > 0.0) {
    ik.demands.port.emplace();
    ik.demands.port->radius = problem_.request.port_radius;
    ik.demands.port->depth = problem_.request.port_depth;
  }
  if (problem_.request.starts > 0)
    ik.starts = static_cast<int>(problem_.request.starts);
  ik.seed = problem_.request.seed;
  ik.cancelled = hooks.cancelled;
  return ik;
}

/// @param share  of this check in the whole computation, 0 to 1
planning::FeasibilityOptions Computation::feasibility(const ComputationHooks& hooks, double share) const {
  planning::FeasibilityOptions options;
  options.ik = ik(hooks);
  if (problem_.request.accept > 0.0)
    options.accept = problem_.request.accept;
  options.progress = [&hooks, share](int done, int all) {
    reportProgress(hooks, share * done / all, "point", done, all);
  };
  return options;
}

planning::FeasibilityReport Computation::checked(const ComputationHooks& hooks,
                                                 double share,
                                                 dds::ComputationResult& result) const {
  auto report = planning::checkTrajectory(problem_.arms, problem_.spec, problem_.start, feasibility(hooks, share));
  result.report = reportOf(report);
  judge(report, result);
  return report;
}

void Computation::check(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  constexpr double kRehearsed = 0.8;  // of the whole
  const bool rehearse = !problem_.request.rehearse.empty();
  const auto report = checked(hooks, rehearse ? kRehearsed : 1.0, result);
  if (!rehearse || report.cancelled || !report.start.empty())
    return;
  const planning::Rehearsal with = rehearsed(hooks, report.path(), "rehearsal");
  const planning::Rehearsal without = rehearsed(hooks, {}, "rehearsal without posture");
  result.rehearsed = 1;
  result.with_posture = reportOf(with);
  result.without_posture = reportOf(without);
  using planning::RehearsalEnd;
  if (with.end == RehearsalEnd::kCancelled || without.end == RehearsalEnd::kCancelled) {
    result.outcome = static_cast<std::uint8_t>(dds::Outcome::kCancelled);
  } else if (report.feasible && with.end != RehearsalEnd::kCompleted) {
    result.outcome = static_cast<std::uint8_t>(dds::Outcome::kNot);
    result.reason = with.reason;
  }
}

/// Simulates the closed loop of control.
planning::Rehearsal Computation::rehearsed(const ComputationHooks& hooks,
                                           const std::vector<safety::RobotVector>& postures,
                                           const char* at) const {
  planning::RehearsalOptions options;
  options.settings = problem_.rehearsal;
  for (const config::Arm& arm : problem_.robot.robot.arms)
    options.arms.push_back(arm.name);
  options.cancelled = hooks.cancelled;
  const double begin = postures.empty() ? 0.9 : 0.8;
  options.progress = [&hooks, at, begin](int done, int all) {
    reportProgress(hooks, begin + 0.1 * done / all, at, done, all);
  };
  return planning::rehearse(problem_.arms, problem_.spec, problem_.start, postures, options);
}

void Computation::repair(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  constexpr double kRounds = 9.0;  // at most; most need fewer
  planning::FeasibilityOptions options = feasibility(hooks, 1.0);
  int round = 0, last = 0;
  options.progress = [&](int done, int all) {
    round += done < last ? 1 : 0;
    last = done;
    const std::string at = round == 0 ? "point" : "round " + std::to_string(round) + ", point";
    reportProgress(hooks, (round + static_cast<double>(done) / all) / kRounds, at, done, all);
  };
  const auto answer =
      planning::repairTrajectory(problem_.arms, problem_.spec, problem_.start, options, problem_.request.smoothing);
  result.report = reportOf(answer.after);
  judge(answer.after, result);
  result.repair.before = reportOf(answer.before);
  result.repair.rounds = static_cast<std::uint32_t>(answer.rounds);
  result.repair.largest_change = answer.largest_change;
  result.repair.rms_change = answer.rms_change;
  if (answer.after.feasible)
    result.repair.trajectory = config::formatTrajectory(answer.spec);
}

void Computation::inverse(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  const planning::IkAnswer answer =
      planning::InverseKinematics(problem_.arms, ik(hooks)).solve(problem_.targets, problem_.start);
  result.ik = reportOf(answer);
  result.reason = answer.reason;
  result.outcome = static_cast<std::uint8_t>(answer.reach == planning::Reach::kReached     ? dds::Outcome::kGood
                                             : answer.reach == planning::Reach::kCancelled ? dds::Outcome::kCancelled
                                                                                           : dds::Outcome::kNot);
}

void Computation::time(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  constexpr double kCheck = 0.9;  // of the whole
  const auto report = checked(hooks, kCheck, result);
  if (!report.feasible)
    return;
  const planning::TimingProblem problem = planning::timingProblem(
      problem_.arms.limits, report.pathFrom(problem_.start),
      {problem_.request.translation_acceleration, problem_.request.rotation_velocity,
       problem_.request.rotation_acceleration, problem_.robot.robot.parameters.snsqp_rotation_velocity});
  reportProgress(hooks, kCheck, "timing", 0, 0);
  const planning::Timing timing = planning::timeOptimal(problem, hooks.cancelled);
  result.timing = reportOf(timing);
  using planning::TimingStatus;
  if (timing.status == TimingStatus::kOptimal)
    return;
  result.outcome = static_cast<std::uint8_t>(timing.status == TimingStatus::kCancelled ? dds::Outcome::kCancelled
                                                                                       : dds::Outcome::kFailed);
  if (timing.status == TimingStatus::kUnlimited)
    result.reason = "a segment of the path moves only joints without a velocity limit";
  else if (timing.status != TimingStatus::kCancelled)
    result.reason = "no optimal timing was found within the iteration limit";
}

void Computation::chooseStart(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  planning::StartOptions options;
  options.feasibility = feasibility(hooks, 0.0);
  options.feasibility.progress = {};
  if (problem_.request.tries > 0)
    options.tries = static_cast<int>(problem_.request.tries);
  options.progress = [&hooks](int done, int all) {
    reportProgress(hooks, static_cast<double>(done) / all, "start", done, all);
  };
  const auto choice = planning::chooseStart(problem_.arms, problem_.spec, problem_.start, options);
  for (const planning::StartCandidate& candidate : choice.candidates)
    result.starts.push_back(reportOf(candidate, problem_.start));
  const bool good = !choice.candidates.empty() && choice.candidates.front().unreachable == 0;
  result.outcome = static_cast<std::uint8_t>(choice.cancelled            ? dds::Outcome::kCancelled
                                             : choice.candidates.empty() ? dds::Outcome::kFailed
                                             : good                      ? dds::Outcome::kGood
                                                                         : dds::Outcome::kNot);
  if (choice.candidates.empty())
    result.reason = "no start configuration with these tips satisfies all limits and requirements";
  else if (!good)
    result.reason =
        "from the best start, " + std::to_string(choice.candidates.front().unreachable) + " points are not reachable";
}

dds::ComputationResult Computation::run(const ComputationHooks& hooks) const noexcept {
  dds::ComputationResult result;
  result.client = problem_.request.client;
  result.request = problem_.request.request;
  result.kind = problem_.request.kind;
  try {
    result.start = listOf(problem_.start);
    switch (static_cast<ComputationKind>(problem_.request.kind)) {
      case ComputationKind::kCheck:
        check(hooks, result);
        break;
      case ComputationKind::kRepair:
        repair(hooks, result);
        break;
      case ComputationKind::kInverseKinematics:
        inverse(hooks, result);
        break;
      case ComputationKind::kTime:
        time(hooks, result);
        break;
      default:
        chooseStart(hooks, result);
        break;
    }
  } catch (const std::exception& error) {
    result.outcome = static_cast<std::uint8_t>(dds::Outcome::kFailed);
    result.reason = error.what();
  }
  if (result.outcome == static_cast<std::uint8_t>(dds::Outcome::kCancelled))
    result.reason = "cancelled" + progressOf(result.report);
  return result;
}

}  // namespace tandem::computation
