// SPDX-License-Identifier: Apache-2.0
#include "planning/inverse_kinematics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "kinematics/tasks/task_kind.h"
#include "planning/detail/ik_search.h"
#include "planning/detail/index.h"

namespace tandem::planning {
namespace {

constexpr double kSlack = 1e-6;       ///< by which a demand may be missed: m, or units of stability
constexpr double kDirection = 1e-6;   ///< rad
constexpr double kForce = 1e-6;       ///< multipliers above this belong to limits that keep the tip from its target
constexpr double kNearlyThere = 0.3;  ///< |r|^2 / 2 of a nearest pose below which the pose itself is tried

std::string format(const char* pattern, double value) {
  char text[96];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

/// Active limits of the nearest pose with their multipliers, the largest first.
std::vector<ActiveLimit> heldBack(const Arms& arms, const PoseProblem& problem, const PoseSolution& nearest) {
  constexpr double kStandsAt = 1e-6, kWeak = 1e-3;  // m or rad; fraction of the largest multiplier
  std::vector<ActiveLimit> held;
  const PosePoint point = evaluate(problem, nearest.q);
  const double pull = kForce * std::max(1.0, std::sqrt(2.0 * point.objective));
  for (Eigen::Index k = 0; k < std::min(nearest.multipliers.size(), point.constraints.size()); ++k) {
    const ConstraintName& row = point.names[static_cast<std::size_t>(k)];
    if (row.kind == ConstraintName::Kind::kRow && nearest.multipliers[k] > pull && point.constraints[k] > -1e-5)
      held.push_back(
          {row.arm, safety::describe(arms.limits[at(row.arm)]->rows[at(row.index)]), nearest.multipliers[k]});
  }
  for (int arm = 0; arm < arms.count() && nearest.joint_multipliers.size() > 0; ++arm) {
    for (int j = 0; j < arms.size(arm); ++j) {
      const int k = arms.offset(arm) + j, n = arms.size(arm) / 2;
      const double force = nearest.joint_multipliers[k];
      const safety::JointLimit& joint = arms.limits[at(arm)]->joints[at(j)];
      const double gap = force > 0.0 ? joint.upper - nearest.q[k] : nearest.q[k] - joint.lower;
      if (std::abs(force) <= pull || gap > kStandsAt)
        continue;
      held.push_back({arm,
                      std::string(force > 0.0 ? "upper" : "lower") + " limit of " +
                          (j < n ? "translation " : "rotation ") + std::to_string(j % n + 1),
                      std::abs(force)});
    }
  }
  std::stable_sort(held.begin(), held.end(), [](const auto& a, const auto& b) { return a.force > b.force; });
  std::erase_if(held, [&](const ActiveLimit& limit) { return limit.force < kWeak * held.front().force; });
  return held;
}

/// Limits of the arm; if it has none, those of all arms.
std::string describeLimits(const Arms& arms, const std::vector<ActiveLimit>& limits, int arm) {
  const bool own = std::any_of(limits.begin(), limits.end(), [arm](const ActiveLimit& l) { return l.arm == arm; });
  std::string reason;
  for (const ActiveLimit& limit : limits) {
    if (limit.arm == arm || !own)
      reason += (reason.empty() ? "" : ", ") + (own ? "" : arms.label(limit.arm) + " ") + limit.description;
  }
  return reason;
}

}  // namespace

double IkAnswer::largestError() const {
  double largest = 0.0;
  for (std::size_t k = 0; k < error.size(); ++k)
    largest = std::max({largest, error[k], k < angle.size() ? kinematics::kLengthPerRadian * angle[k] : 0.0});
  return largest;
}

InverseKinematics::InverseKinematics(Arms arms, IkOptions options)
    : arms_(std::move(arms)), options_(std::move(options)) {
  for (const safety::ArmLimits* limits : arms_.limits)
    samplers_.emplace_back(*limits);
}

/// Checks a solution against all constraints and demands. @return whether it reaches the targets and satisfies all.
bool InverseKinematics::take(Search& search, const PoseProblem& problem, const PoseSolution& solution) const {
  PoseProblem all = problem;
  all.demands = options_.demands;
  const PosePoint point = evaluate(all, solution.q);
  if (!point.answered)
    return false;
  IkAnswer answer;
  answer.q = solution.q;
  answer.branches = point.branches;
  bool there = true, turned = true;
  for (const kinematics::Tip& tip : point.tips) {
    answer.tips.push_back(tip.pose.translation());
    answer.stability = std::min(answer.stability, tip.conjugate_points > 0 ? 0.0 : tip.stability);
  }
  for (const TipTarget& target : problem.targets) {
    const kinematics::Tip& tip = point.tips[at(target.arm)];
    answer.error.push_back((tip.pose.translation() - target.position).norm());
    there = there && answer.error.back() <= options_.tolerance;
    answer.angle.push_back(target.turned(tip.pose));
    turned = turned && answer.angle.back() <= kDirection;
  }
  bool inside = true;
  Reach reach = Reach::kReached;
  Demands& needed = search.problem.demands;
  for (Eigen::Index k = 0; k < point.constraints.size(); ++k) {
    const double value = point.constraints[k];
    switch (point.names[static_cast<std::size_t>(k)].kind) {
      case ConstraintName::Kind::kRow:
        inside = inside && value <= 1e-8;
        break;
      case ConstraintName::Kind::kRelative:
        inside = inside && std::abs(value) <= 1e-4;  // 1e-6 m
        break;
      case ConstraintName::Kind::kStability:
        if (value < -kSlack || answer.stability <= 0.0)
          needed.stability = options_.demands.stability, reach = Reach::kUnstable;
        break;
      case ConstraintName::Kind::kClearance:
        answer.clearance = std::min(answer.clearance, *options_.demands.clearance + kLengthUnit * value);
        if (kLengthUnit * value < -kSlack)
          needed.clearance = options_.demands.clearance, reach = Reach::kArmsTouch;
        break;
      case ConstraintName::Kind::kPort:
        if (kLengthUnit * value < -kSlack) {
          needed.port = options_.demands.port;
          needed.port_clearance = options_.demands.port_clearance;
          reach = Reach::kPortTouched;
        }
        break;
      default:
        break;
    }
  }
  answer.reach = reach;
  if (!inside)
    return false;
  if (there && turned && reach != Reach::kReached && !search.broken)
    search.broken = reach;
  if (reach != Reach::kReached)
    return false;
  if (there && turned) {
    search.best = answer;
    search.reached = true;
    return true;
  }
  if (!problem.nearest)
    return false;
  const double objective = point.objective;
  if (objective < search.least) {
    search.least = objective;
    search.best = answer;
    search.nearest = solution;
    search.nearest_problem = problem;
  }
  return false;
}

IkAnswer InverseKinematics::judge(const std::vector<TipTarget>& targets,
                                  const safety::RobotVector& q,
                                  const std::vector<kinematics::Branch>& branches) const {
  constexpr double kViolation = 1e-9;
  Search search;
  search.best.q = q;
  search.best.reach = Reach::kIterationLimit;
  search.problem = {&arms_, targets, q, branches, false, false, {}};
  for (int arm = 0; arm < arms_.count(); ++arm) {
    if (safety::largestViolation(*arms_.limits[at(arm)], q.segment(arms_.offset(arm), arms_.size(arm))) > kViolation)
      return search.best;
  }
  PoseSolution solution;
  solution.q = q;
  take(search, search.problem, solution);
  return search.best;
}

/// From a start to the pose itself. Demands that a solution violates become constraints of the next try.
void InverseKinematics::attempt(Search& search, const safety::RobotVector& from) const {
  constexpr int kTries = 4, kShort = 40;  // more iterations seldom succeed
  ++search.starts;
  for (int i = 0; i < kTries && !search.reached && !cancelled(); ++i) {
    const PoseProblem problem = search.problem;
    const PoseSolution solution =
        planning::solve(problem, from, std::min(options_.max_iterations, kShort), options_.cancelled);
    search.iterations += solution.iterations;
    if (take(search, problem, solution))
      return;
    const Demands &before = problem.demands, &now = search.problem.demands;
    const bool more = before.stability != now.stability || before.clearance != now.clearance ||
                      before.port.has_value() != now.port.has_value();
    if (!more)
      return;
  }
}

/// From a start to the nearest pose; then to the pose itself if the nearest pose is close to it.
void InverseKinematics::improve(Search& search, const safety::RobotVector& start) const {
  constexpr int kTries = 4;
  ++search.starts;
  safety::RobotVector from = start;
  for (int i = 0; i < kTries && !cancelled(); ++i) {
    PoseProblem problem = search.problem;
    problem.nearest = true;
    const PoseSolution solution = planning::solve(problem, from, options_.max_iterations, options_.cancelled);
    search.iterations += solution.iterations;
    const Demands before = problem.demands;
    if (take(search, problem, solution))
      break;
    const Demands& now = search.problem.demands;
    if (before.stability == now.stability && before.clearance == now.clearance &&
        before.port.has_value() == now.port.has_value()) {
      from = solution.q;
      break;
    }
  }
  PoseProblem near = search.problem;
  near.nearest = true;
  const safety::RobotVector q = search.reached ? search.best.q : from;
  const PosePoint point = evaluate(near, q);
  if (!point.answered || point.objective > kNearlyThere)
    return;
  search.reached = false;
  const IkAnswer found = search.best;
  attempt(search, q);
  --search.starts;
  if (!search.reached && found.reach == Reach::kReached && found.largestError() <= options_.tolerance) {
    search.best = found;
    search.reached = true;
  }
}

/// Writes the reason why the nearest pose is not the target.
void InverseKinematics::explain(Search& search) const {
  IkAnswer& best = search.best;
  if (best.tips.empty()) {
    best.reach = Reach::kIterationLimit;
    best.reason = "no solution within the iteration limit; try more starts or another start configuration";
    return;
  }
  if (const Demands& needed = search.problem.demands; !search.broken && !cancelled()) {
    // Are the demands the reason? Not if the targets are unreachable without them, too.
    IkOptions plain = options_;
    plain.demands = {};
    const bool any = needed.stability || needed.clearance || needed.port;
    const PoseProblem& wanted = search.problem;
    if (any && InverseKinematics(arms_, plain).solve(wanted.targets, wanted.reference, wanted.branches).reach ==
                   Reach::kReached)
      search.broken = needed.stability ? Reach::kUnstable : needed.clearance ? Reach::kArmsTouch : Reach::kPortTouched;
  }
  best.limits = heldBack(arms_, search.nearest_problem, search.nearest);
  best.reach = search.broken ? *search.broken : best.limits.empty() ? Reach::kOutsideWorkspace : Reach::kLimits;
  for (std::size_t k = 0; k < best.error.size(); ++k) {
    const bool turned = best.angle[k] > kDirection;
    if (best.error[k] <= options_.tolerance && !turned && best.error.size() > 1)
      continue;
    best.reason += (best.reason.empty() ? "" : "; ") + arms_.label(search.problem.targets[k].arm) + ": " +
                   format("%.3g mm ", 1e3 * best.error[k]);
    if (turned)
      best.reason += format("and %.3g degrees ", best.angle[k] * 180.0 / std::numbers::pi);
    if (best.reach == Reach::kOutsideWorkspace)
      best.reason += "beyond the edge of the workspace";
    else if (best.reach == Reach::kLimits)
      best.reason += "away, limited by " + describeLimits(arms_, best.limits, search.problem.targets[k].arm);
    else if (best.reach == Reach::kUnstable)
      best.reason += "away; in the exact pose an arm is less stable than required";
    else if (best.reach == Reach::kArmsTouch)
      best.reason += "away; in the exact pose the arms are closer to each other than required";
    else
      best.reason += "away; in the exact pose an arm is closer to the port than required";
  }
}

IkAnswer InverseKinematics::solve(const std::vector<TipTarget>& targets,
                                  const safety::RobotVector& reference,
                                  const std::vector<kinematics::Branch>& branches,
                                  bool keep_relative) const {
  constexpr double kAside = 0.05;                     // rad, out of a plane
  constexpr double kAlmost = 1e-3, kHopeless = 3e-3;  // m
  constexpr int kBatches = 4, kAsides = 3;
  constexpr double kUnit = 1e-6;
  Search search;
  search.best.q = reference;
  bool valid = reference.size() == arms_.jointCount() && reference.allFinite() && !targets.empty();
  for (const TipTarget& target : targets) {
    valid = valid && target.arm >= 0 && target.arm < arms_.count() && target.position.allFinite() &&
            (!target.direction || std::abs(target.direction->norm() - 1.0) < kUnit) &&
            (!target.orientation || std::abs(target.orientation->norm() - 1.0) < kUnit);
  }
  if (!valid) {
    search.best.reason =
        "expected at least one target, all finite, for arms of the robot and with directions and quaternions of length "
        "1, and a finite reference of all joints";
    return search.best;
  }
  search.problem = {&arms_, targets, reference, branches, false, keep_relative && targets.size() > 1, {}};
  search.problem.translation_trust = options_.translation_trust;
  search.problem.rotation_trust = options_.rotation_trust;
  std::mt19937_64 engine(options_.seed);
  attempt(search, neighbour(reference, 0.0, engine));
  double turn = kAside;
  for (int i = 0; i < (options_.local ? kAsides : 1) && !search.reached && !cancelled(); ++i, turn *= 2.0) {
    const safety::RobotVector aside = neighbour(reference, turn, engine);
    if (options_.local)
      attempt(search, aside);
    if (!search.reached)
      improve(search, aside);
    if (search.best.largestError() > kHopeless)
      break;
  }
  // A nearest pose close to the targets justifies more starts.
  for (int batch = 0; batch < kBatches && !search.reached && !options_.local; ++batch) {
    if (batch > 0 && !(search.best.largestError() < kAlmost))
      break;
    for (const safety::RobotVector& other : starts(search.problem, options_.seed + static_cast<std::uint64_t>(batch))) {
      if (search.reached || cancelled())
        break;
      improve(search, other);
    }
  }
  if (!options_.local && !search.best.tips.empty())
    polish(search, engine);
  if (!search.reached && search.best.tips.empty() && search.problem.keep_relative && !cancelled())
    return solve(targets, reference, branches, false);  // no pose keeps the difference
  search.best.starts = search.starts;
  search.best.iterations = search.iterations;
  if (cancelled() && !search.reached) {
    search.best.reach = Reach::kCancelled;
    search.best.reason = "cancelled";
  } else if (!search.reached) {
    explain(search);
  }
  return search.best;
}

}  // namespace tandem::planning
