// SPDX-License-Identifier: Apache-2.0
#include "services/planning/computation.h"

#include <algorithm>
#include <cmath>

#include "services/dds/validate.h"
#include "services/planning/reports.h"

namespace tandem::service {
namespace {

using dds::ComputationKind;

std::string textOf(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", number);
  return text;
}

[[noreturn]] void refuse(const std::string& key, const std::string& found, const std::string& expected) {
  throw Refusal(dds::ReplyCode::kMalformed, key + ": found " + found + ", expected " + expected);
}

void expectRange(const std::string& key, double value, double least, double most, const std::string& unit) {
  if (!(value >= least && value <= most))
    refuse(key, textOf(value), "a number from " + textOf(least) + " to " + textOf(most) + unit);
}

std::string namesOf(const config::Robot& robot) {
  std::string names;
  for (const config::Arm& arm : robot.arms)
    names += (names.empty() ? "" : ", ") + arm.name;
  return names;
}

void tell(const ComputationHooks& hooks, double fraction, const std::string& at, int done, int all) {
  if (hooks.progress)
    hooks.progress(fraction, at, done, all);
}

/// A limit of a joint that the client may set instead of the robot's.
double chosen(double wanted, double by_robot, double otherwise) {
  return wanted > 0.0 ? wanted : std::isfinite(by_robot) ? by_robot : otherwise;
}

void judge(const planning::FeasibilityReport& report, dds::ComputationResult& result) {
  result.outcome = static_cast<std::uint8_t>(report.cancelled  ? dds::Outcome::kCancelled
                                             : report.feasible ? dds::Outcome::kGood
                                                               : dds::Outcome::kNot);
  if (!report.start.empty())
    result.reason = report.start;
  else if (!report.feasible && !report.cancelled)
    result.reason =
        std::to_string(report.unreachable()) + " of " + std::to_string(report.points.size()) + " points cannot be had";
}

}  // namespace

Computation::Computation(dds::ComputationRequest request,
                         const ComputationRobot& robot,
                         const std::optional<safety::RobotVector>& present)
    : request_(std::move(request)), robot_(robot), arms_{robot.model.models(), robot.model.limits()} {
  const int kind = request_.kind;
  if (kind < static_cast<int>(ComputationKind::kCheck) || kind > static_cast<int>(ComputationKind::kChooseStart))
    throw Refusal(dds::ReplyCode::kUnknown, "kind: found " + std::to_string(kind) + ", expected 1 to 7");
  checkNumbers();
  if (!request_.rehearse.empty() && !control::methodFromName(request_.rehearse))
    refuse("rehearse", "'" + request_.rehearse.substr(0, 40) + "'", "nsp, nspwln, nspwln-joint, nspqp or snsqp");
  const auto joints = static_cast<std::size_t>(arms_.jointCount());
  if (!request_.joints.empty() && request_.joints.size() != joints)
    refuse("joints", std::to_string(request_.joints.size()), std::to_string(joints) + " of " + namesOf(robot.robot));
  for (std::size_t j = 0; j < request_.joints.size(); ++j) {
    if (!std::isfinite(request_.joints[j]))
      refuse("joints[" + std::to_string(j) + "]", textOf(request_.joints[j]), "a finite number, m or rad");
  }
  if (request_.joints.empty() && !present)
    throw Refusal(dds::ReplyCode::kWrongState,
                  "joints: found none, expected some: the robot's present joints are not known (no valid "
                  "actuation/state)");
  start_ = request_.joints.empty() ? *present
                                   : safety::RobotVector(Eigen::Map<const Eigen::VectorXd>(
                                         request_.joints.data(), static_cast<Eigen::Index>(joints)));
  if (kind == static_cast<int>(ComputationKind::kInverseKinematics))
    readTargets();
  else
    readTrajectory();
}

void Computation::checkNumbers() const {
  constexpr double kFar = 1.0, kFast = 1e3;
  expectRange("stability", request_.stability, 0.0, 1.0, "");
  expectRange("clearance", request_.clearance, 0.0, kFar, " m");
  expectRange("port_radius", request_.port_radius, 0.0, kFar, " m");
  expectRange("port_depth", request_.port_depth, 0.0, kFar, " m");
  expectRange("accept", request_.accept, 0.0, kFar, " m");
  expectRange("starts", request_.starts, 0, 1000, "");
  expectRange("tries", request_.tries, 0, 10000, "");
  expectRange("smoothing", request_.smoothing, 0.0, 1e12, "");
  expectRange("translation_acceleration", request_.translation_acceleration, 0.0, kFast, " m/s^2");
  expectRange("rotation_velocity", request_.rotation_velocity, 0.0, kFast, " rad/s");
  expectRange("rotation_acceleration", request_.rotation_acceleration, 0.0, kFast, " rad/s^2");
  expectRange("time_limit", request_.time_limit, 0.0, 3600.0, " s");
}

void Computation::readTargets() {
  if (request_.targets.empty() || request_.targets.size() > kMostTargets)
    refuse("targets", std::to_string(request_.targets.size()), "1 to " + std::to_string(kMostTargets));
  for (std::size_t k = 0; k < request_.targets.size(); ++k) {
    const dds::TipTarget& from = request_.targets[k];
    const std::string key = "targets[" + std::to_string(k) + "].";
    if (from.arm >= arms_.count())
      refuse(key + "arm", std::to_string(from.arm),
             "0 to " + std::to_string(arms_.count() - 1) + " for " + namesOf(robot_.robot));
    planning::TipTarget target;
    target.arm = from.arm;
    for (const planning::TipTarget& other : targets_) {
      if (other.arm == target.arm)
        refuse(key + "arm", std::to_string(from.arm) + " a second time", "one target an arm");
    }
    target.position = Eigen::Vector3d::Map(from.position.data());
    if (!target.position.allFinite())
      refuse(key + "position", "a number that is not finite", "three finite numbers, m");
    if (from.has_direction != 0) {
      const Eigen::Vector3d direction = Eigen::Vector3d::Map(from.direction.data());
      if (!direction.allFinite() || !(direction.norm() > 1e-9) || direction.norm() > 1e9)
        refuse(key + "direction", "a length of " + textOf(direction.norm()), "a finite vector with a length");
      target.direction = direction.normalized();
    }
    targets_.push_back(target);
  }
}

void Computation::readTrajectory() {
  if (request_.trajectory.size() > dds::kMaxTrajectory)
    refuse("trajectory", std::to_string(request_.trajectory.size()) + " bytes",
           "at most " + std::to_string(dds::kMaxTrajectory));
  try {
    spec_ = config::parseTrajectory(request_.trajectory, "trajectory", {});  // names no files
  } catch (const std::exception& error) {
    throw Refusal(dds::ReplyCode::kMalformed, error.what());
  }
  for (const auto& [key, arm] : {std::pair{"arm", spec_.arm}, std::pair{"other_arm", spec_.other_arm}}) {
    if (arm < 0 || arm >= arms_.count())
      refuse(std::string("trajectory: ") + key, std::to_string(arm),
             "0 to " + std::to_string(arms_.count() - 1) + " for " + namesOf(robot_.robot));
  }
  if (spec_.point_count > kMostPoints && request_.kind != static_cast<std::uint8_t>(ComputationKind::kChooseStart))
    refuse("trajectory: points", std::to_string(spec_.point_count), "at most " + std::to_string(kMostPoints));
  kinematics::Tip tips[2];
  for (int k = 0; k < 2; ++k) {
    const int arm = k == 0 ? spec_.arm : spec_.other_arm;
    const Eigen::VectorXd own = start_.segment(arms_.offset(arm), arms_.size(arm));
    if (arms_.models[static_cast<std::size_t>(arm)]->tip(own, tips[k]) != kinematics::ModelStatus::kOk)
      return;  // what is wrong with the start is for the report to say
  }
  try {
    planning::TrajectorySpec coarse = spec_;
    coarse.point_count = 1;
    const Eigen::Vector3d tip = tips[0].pose.translation();
    planning::sample(coarse, tip, tip - tips[1].pose.translation());
  } catch (const std::invalid_argument& error) {
    throw Refusal(dds::ReplyCode::kMalformed, error.what());
  }
}

planning::IkOptions Computation::ik(const ComputationHooks& hooks) const {
  planning::IkOptions ik;
  // A rigid arm never snaps.
  if (!robot_.rigid)
    ik.demands.stability = request_.stability;
  if (request_.arms_may_touch == 0 && arms_.count() > 1)
    ik.demands.clearance = request_.clearance;
  if (request_.port_radius > 0.0) {
    ik.demands.port.emplace();
    ik.demands.port->radius = request_.port_radius;
    ik.demands.port->depth = request_.port_depth;
  }
  if (request_.starts > 0)
    ik.starts = static_cast<int>(request_.starts);
  ik.seed = request_.seed;
  ik.cancelled = hooks.cancelled;
  return ik;
}

/// @param share  of the whole that this check is
planning::FeasibilityOptions Computation::feasibility(const ComputationHooks& hooks, double share) const {
  planning::FeasibilityOptions options;
  options.ik = ik(hooks);
  if (request_.accept > 0.0)
    options.accept = request_.accept;
  options.progress = [&hooks, share](int done, int all) { tell(hooks, share * done / all, "point", done, all); };
  return options;
}

planning::FeasibilityReport Computation::checked(const ComputationHooks& hooks,
                                                 double share,
                                                 dds::ComputationResult& result) const {
  const auto report = planning::checkTrajectory(arms_, spec_, start_, feasibility(hooks, share));
  result.report = reportOf(report);
  judge(report, result);
  return report;
}

void Computation::check(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  constexpr double kRehearsed = 0.8;  // of the whole
  const bool rehearse = !request_.rehearse.empty();
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
    result.reason = with.words;
  }
}

/// The closed loop, as control would run it.
planning::Rehearsal Computation::rehearsed(const ComputationHooks& hooks,
                                           const std::vector<safety::RobotVector>& postures,
                                           const char* at) const {
  planning::RehearsalOptions options;
  options.method = *control::methodFromName(request_.rehearse);
  options.parameters = robot_.robot.parameters;
  if (robot_.period > 0.0)
    options.parameters.period = robot_.period;
  options.gains = robot_.gains;
  for (const config::Arm& arm : robot_.robot.arms)
    options.arms.push_back(arm.name);
  options.cancelled = hooks.cancelled;
  const double begin = postures.empty() ? 0.9 : 0.8;
  options.progress = [&hooks, at, begin](int done, int all) { tell(hooks, begin + 0.1 * done / all, at, done, all); };
  return planning::rehearse(arms_, spec_, start_, postures, options);
}

void Computation::repair(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  constexpr double kRounds = 9.0;  // at most; most need fewer
  planning::FeasibilityOptions options = feasibility(hooks, 1.0);
  int round = 0, last = 0;
  options.progress = [&](int done, int all) {
    round += done < last ? 1 : 0;
    last = done;
    const std::string at = round == 0 ? "point" : "round " + std::to_string(round) + ", point";
    tell(hooks, (round + static_cast<double>(done) / all) / kRounds, at, done, all);
  };
  const auto answer = planning::repairTrajectory(arms_, spec_, start_, options, request_.smoothing);
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
  const planning::IkAnswer answer = planning::InverseKinematics(arms_, ik(hooks)).solve(targets_, start_);
  result.ik = reportOf(answer);
  result.reason = answer.words;
  result.outcome = static_cast<std::uint8_t>(answer.reach == planning::Reach::kReached     ? dds::Outcome::kGood
                                             : answer.reach == planning::Reach::kCancelled ? dds::Outcome::kCancelled
                                                                                           : dds::Outcome::kNot);
}

void Computation::time(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  constexpr double kCheck = 0.9;  // of the whole
  const auto report = checked(hooks, kCheck, result);
  if (!report.feasible)
    return;
  planning::TimingProblem problem;
  const int joints = arms_.jointCount();
  problem.path.resize(joints, static_cast<Eigen::Index>(report.points.size()) + 1);
  problem.path.col(0) = start_;
  for (std::size_t k = 0; k < report.points.size(); ++k)
    problem.path.col(static_cast<Eigen::Index>(k) + 1) = report.points[k].q;
  problem.velocity.resize(joints);
  problem.acceleration.resize(joints);
  for (int arm = 0, j = 0; arm < arms_.count(); ++arm) {
    const safety::ArmLimits& limits = *arms_.limits[static_cast<std::size_t>(arm)];
    for (int k = 0; k < limits.jointCount(); ++k, ++j) {
      const safety::JointLimit& limit = limits.joints[static_cast<std::size_t>(k)];
      const bool translation = k < limits.jointCount() / 2;
      problem.velocity[j] = chosen(translation ? 0.0 : request_.rotation_velocity, limit.velocity,
                                   robot_.robot.parameters.snsqp_rotation_velocity);
      problem.acceleration[j] = chosen(translation ? request_.translation_acceleration : request_.rotation_acceleration,
                                       limit.slew_limit, safety::kUnlimited);
    }
  }
  tell(hooks, kCheck, "timing", 0, 0);
  const planning::Timing timing = planning::timeOptimal(problem, hooks.cancelled);
  result.timing = reportOf(timing);
  using planning::TimingStatus;
  if (timing.status == TimingStatus::kOptimal)
    return;
  result.outcome = static_cast<std::uint8_t>(timing.status == TimingStatus::kCancelled ? dds::Outcome::kCancelled
                                                                                       : dds::Outcome::kFailed);
  if (timing.status == TimingStatus::kUnlimited)
    result.reason = "a piece of the path moves only joints without a velocity limit";
  else if (timing.status != TimingStatus::kCancelled)
    result.reason = "no optimal timing was found within the limit of the iterations";
}

void Computation::chooseStart(const ComputationHooks& hooks, dds::ComputationResult& result) const {
  planning::StartOptions options;
  options.feasibility = feasibility(hooks, 0.0);
  options.feasibility.progress = {};
  if (request_.tries > 0)
    options.tries = static_cast<int>(request_.tries);
  options.progress = [&hooks](int done, int all) { tell(hooks, static_cast<double>(done) / all, "start", done, all); };
  const auto choice = planning::chooseStart(arms_, spec_, start_, options);
  for (const planning::StartCandidate& candidate : choice.candidates)
    result.starts.push_back(reportOf(candidate, start_));
  const bool good = !choice.candidates.empty() && choice.candidates.front().unreachable == 0;
  result.outcome = static_cast<std::uint8_t>(choice.cancelled            ? dds::Outcome::kCancelled
                                             : choice.candidates.empty() ? dds::Outcome::kFailed
                                             : good                      ? dds::Outcome::kGood
                                                                         : dds::Outcome::kNot);
  if (choice.candidates.empty())
    result.reason = "no start has these tips within the limits and demands";
  else if (!good)
    result.reason =
        "from the best start, " + std::to_string(choice.candidates.front().unreachable) + " points cannot be had";
}

dds::ComputationResult Computation::run(const ComputationHooks& hooks) const noexcept {
  dds::ComputationResult result;
  result.client = request_.client;
  result.request = request_.request;
  result.kind = request_.kind;
  try {
    result.start = listOf(start_);
    switch (static_cast<ComputationKind>(request_.kind)) {
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
    result.reason = "cancelled";
  return result;
}

}  // namespace tandem::service
