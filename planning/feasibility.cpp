// SPDX-License-Identifier: Apache-2.0
#include "planning/feasibility.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "planning/detail/index.h"
#include "planning/detail/step_path.h"
#include "planning/detail/trajectory_start.h"
#include "planning/insertion.h"

namespace tandem::planning {
namespace {

using Eigen::Vector3d;

/// Second singular value of the rotations' columns.
double rotationConditioning(const kinematics::Tip& tip) {
  const auto n = tip.jacobian.cols() / 2;
  const Eigen::MatrixXd rotations = tip.jacobian.topRightCorner(3, n);
  return Eigen::JacobiSVD<Eigen::MatrixXd>(rotations).singularValues()[1];
}

/** Continuation along the points of a trajectory. */
class Walker {
 public:
  Walker(const Arms& arms, const TrajectorySpec& spec, const FeasibilityOptions& options, Start start)
      : arms_(arms),
        spec_(spec),
        options_(options),
        near_(arms, local(options)),
        far_(arms, tolerant(options.ik, options.accept)),
        judge_(arms, accepting(options)),
        step_path_(arms, spec),
        branches_(std::move(start.branches)) {
    last_ = positionsAt(spec, [&](int arm) { return start.tips[at(arm)].pose; });
  }

  /// See detail/trajectory_start.h.
  std::string unmetAtStart(const safety::RobotVector& q) const {
    return planning::unmetAtStart(arms_, targetsOf(last_), q, branches_, judge_, near_, options_.ik.demands);
  }

  PointReport step(int number, const TrajectoryPoint& point, const safety::RobotVector& q) {
    const std::vector<TipTarget> targets = targetsOf(point);
    if (const auto* insertion = std::get_if<Insertion>(&spec_.shape)) {
      const IkAnswer own = judge_.judge(targets, insertion->joints[at(number - 1)], branches_);
      if (own.reach == Reach::kReached)
        return take(number, point, own);
    }
    IkAnswer answer = near_.solve(targets, q, branches_, true);
    const bool reached = answer.reach == Reach::kReached;
    if (reached && follow(last_, point, q, answer, options_.halvings))
      answer.reach = Reach::kReached;
    else if (!demanded(answer.reach) && walks(point, targets, q, answer))
      answer.reach = Reach::kReached;
    else if (reached)
      answer.reach = cancelled() ? Reach::kCancelled : Reach::kReconfiguration;
    else if (answer.reach != Reach::kReached && answer.reach != Reach::kCancelled && !followsKnownEdge(answer)) {
      IkAnswer elsewhere = far_.solve(targets, q, {}, true);
      if (elsewhere.reach == Reach::kReached && follow(last_, point, q, elsewhere, options_.halvings))
        answer = elsewhere;
      else if (elsewhere.reach == Reach::kReached && !demanded(answer.reach))
        answer.reach = Reach::kReconfiguration;
      else if (answer.tips.empty())
        answer = elsewhere;
    }
    if (answer.reach == Reach::kReconfiguration && answer.largestError() <= options_.accept)
      stay(targets, q, answer);
    const bool elsewhere = answer.reach == Reach::kReconfiguration;
    if (elsewhere || answer.reach == Reach::kLimits || answer.reach == Reach::kOutsideWorkspace)
      converge(point, targets, answer);
    if (elsewhere && answer.reach != Reach::kReached) {
      answer.reach = Reach::kReconfiguration;
      answer.reason =
          "not reachable continuously from the previous point, only with a different configuration of the arms";
    }
    return take(number, point, answer);
  }

  /// Simulates control steps along the whole trajectory from the start. @return whether they reach all points.
  bool walkAll(TrajectoryPoint from,
               const std::vector<TrajectoryPoint>& points,
               safety::RobotVector q,
               std::vector<kinematics::Branch> branches,
               std::vector<PointReport>& reports) const {
    for (const TrajectoryPoint& point : points) {
      const std::vector<TipTarget> targets = targetsOf(point);
      const auto there = step_path_.go(from, point, q, 0.9 * options_.accept, options_.ik.cancelled);
      if (!there)
        return false;
      IkAnswer answer = judge_.judge(targets, *there, branches);
      if (answer.reach != Reach::kReached)
        answer = near_.solve(targets, *there, branches, true);
      if (answer.reach != Reach::kReached || (answer.q != *there && jumps(*there, answer.q)))
        return false;
      q = answer.q;
      branches = answer.branches;
      reports.push_back(reportOf(static_cast<int>(reports.size()) + 1, point, answer));
      from = point;
    }
    return true;
  }

 private:
  /// Continues from an answer.
  PointReport take(int number, const TrajectoryPoint& point, const IkAnswer& answer) {
    edge_ = answer.reach;
    PointReport report = reportOf(number, point, answer);
    if (answer.reach == Reach::kReached)
      branches_ = answer.branches;
    last_ = {report.tip, report.actual_relative};
    return report;
  }
  std::vector<TipTarget> targetsOf(const TrajectoryPoint& point) const {
    std::vector<TipTarget> targets{{spec_.arm, point.tip, {}}};
    if (spec_.hasRelative())
      targets.push_back({spec_.other_arm, point.tip - point.relative, {}});
    return targets;
  }
  bool cancelled() const { return options_.ik.cancelled && options_.ik.cancelled(); }

  /** Whether joints move continuously from q to an answer along the straight path of the tips. Paths with large joint
   * motion are halved; a remaining jump is a discontinuity. @param answer  at `to`; replaced by the result of the
   * halves */
  bool follow(const TrajectoryPoint& from,
              const TrajectoryPoint& to,
              const safety::RobotVector& q,
              IkAnswer& answer,
              int halvings) const {
    if (!jumps(q, answer.q))
      return true;
    if (halvings == 0 || cancelled())
      return false;
    const TrajectoryPoint middle{0.5 * (from.tip + to.tip), 0.5 * (from.relative + to.relative)};
    IkAnswer half = near_.solve(targetsOf(middle), q, branches_, true);
    if (half.reach != Reach::kReached || !follow(from, middle, q, half, halvings - 1))
      return false;
    answer = near_.solve(targetsOf(to), half.q, half.branches, true);
    return answer.reach == Reach::kReached && follow(middle, to, half.q, answer, halvings - 1);
  }

  /// Whether simulated control steps lead from q to a point. @param answer  replaced by their result
  bool walks(const TrajectoryPoint& point,
             const std::vector<TipTarget>& targets,
             const safety::RobotVector& q,
             IkAnswer& answer) const {
    if (last_.tip.hasNaN() || cancelled())
      return false;
    const auto there = step_path_.go(last_, point, q, 0.9 * options_.accept, options_.ik.cancelled);
    if (!there)
      return false;
    IkAnswer found = judge_.judge(targets, *there, branches_);
    if (found.reach == Reach::kReached) {
      answer = std::move(found);
      return true;
    }
    found = near_.solve(targets, *there, branches_, true);
    if (found.reach != Reach::kReached || jumps(*there, found.q))
      return false;
    answer = std::move(found);
    return true;
  }

  /// Answer at the present joints, which may be far from the targets.
  void stay(const std::vector<TipTarget>& targets, const safety::RobotVector& q, IkAnswer& answer) const {
    IkAnswer here = standingAt(targets, q);
    if (here.reach != Reach::kReached)
      return;
    here.reach = answer.reach;
    answer = std::move(here);
  }

  /// Joints as an answer for targets that they miss. kReached: all demands are satisfied there.
  IkAnswer standingAt(const std::vector<TipTarget>& targets, const safety::RobotVector& q) const {
    std::vector<TipTarget> here = targets;
    for (TipTarget& target : here) {
      kinematics::Branch branch = branches_[at(target.arm)];
      kinematics::Tip tip;
      const Eigen::VectorXd own = q.segment(arms_.offset(target.arm), arms_.size(target.arm));
      if (arms_.models[at(target.arm)]->tip(own, branch, tip) != kinematics::ModelStatus::kOk)
        return {};
      target.position = tip.pose.translation();
    }
    IkAnswer answer = judge_.judge(here, q, branches_);
    for (std::size_t k = 0; k < std::min(targets.size(), answer.error.size()); ++k)
      answer.error[k] = (here[k].position - targets[k].position).norm();
    return answer;
  }

  /// A nearest pose among joints near those of the previous point may not be the nearest of all: continues from it in
  /// simulated control steps, and reports the limits at which they end.
  void converge(const TrajectoryPoint& point, const std::vector<TipTarget>& targets, IkAnswer& answer) const {
    constexpr double kNearer = 0.99;
    constexpr int kTries = 3;
    StepPath::End end = step_path_.converge(point, answer.q, options_.ik.cancelled);
    for (int i = 0; i < kTries && end.error < kNearer * answer.largestError() && !cancelled(); ++i) {
      IkAnswer again = near_.solve(targets, end.q, branches_, true);
      if (again.reach == Reach::kReached && !jumps(end.q, again.q)) {
        answer = std::move(again);
        return;
      }
      if (again.tips.empty() || !(again.largestError() < kNearer * end.error))
        break;
      const StepPath::End further = step_path_.converge(point, again.q, options_.ik.cancelled);
      if (!(further.error < kNearer * end.error))
        break;
      end = further;
    }
    if (!(end.error < kNearer * answer.largestError()))
      return;
    IkAnswer nearer = standingAt(targets, end.q);
    if (nearer.reach != Reach::kReached)
      return;
    nearer.reach = end.limits.empty() ? Reach::kOutsideWorkspace : Reach::kLimits;
    char distance[48];
    std::snprintf(distance, sizeof distance, "%.3g mm ", 1e3 * end.error);
    nearer.reason = arms_.label(spec_.arm) + ": " + distance +
                    std::string(end.limits.empty() ? "beyond the edge of the workspace" : "away, limited by ");
    for (std::size_t k = 0; k < end.limits.size(); ++k)
      nearer.reason += (k > 0 ? ", " : "") + end.limits[k];
    answer = std::move(nearer);
  }

  static IkOptions tolerant(IkOptions ik, double accept) {
    ik.tolerance = std::min(ik.tolerance, accept);
    return ik;
  }
  static IkOptions accepting(const FeasibilityOptions& options) {
    IkOptions ik = options.ik;
    ik.tolerance = options.accept;
    return ik;
  }
  static IkOptions local(const FeasibilityOptions& options) {
    IkOptions ik = tolerant(options.ik, options.accept);
    ik.local = true;
    ik.translation_trust = options.translation_jump;
    ik.rotation_trust = options.rotation_jump;
    return ik;
  }
  /// Whether the previous point was unreachable for the same reason: then the global search has just been done.
  bool followsKnownEdge(const IkAnswer& answer) const {
    constexpr double kFar = 3e-3;  // m: smaller errors are searched again
    return edge_ == answer.reach && !answer.tips.empty() && answer.largestError() > kFar;
  }
  /// Whether a demand, not the joints, is the reason.
  static bool demanded(Reach reach) {
    return reach == Reach::kUnstable || reach == Reach::kArmsTouch || reach == Reach::kPortTouched;
  }

  bool jumps(const safety::RobotVector& from, const safety::RobotVector& to) const {
    for (int j = 0; j < from.size(); ++j) {
      const double allowed = PoseProblem::unit(arms_, j) < 1.0 ? options_.translation_step : options_.rotation_step;
      if (std::abs(to[j] - from[j]) > allowed)
        return true;
    }
    return false;
  }

  PointReport reportOf(int number, const TrajectoryPoint& point, const IkAnswer& answer) const {
    PointReport report;
    report.point = number;
    report.wanted = point;
    report.q = answer.q;
    report.reach = answer.reach;
    report.reason = answer.reason;
    report.stability = answer.stability;
    report.clearance = answer.clearance;
    report.error = report.relative_error = std::numeric_limits<double>::infinity();
    std::vector<Eigen::Isometry3d> tips;
    for (int arm = 0; arm < arms_.count(); ++arm) {
      kinematics::Branch branch = branches_[at(arm)];
      kinematics::Tip tip;
      if (arms_.models[at(arm)]->tip(answer.q.segment(arms_.offset(arm), arms_.size(arm)), branch, tip) !=
          kinematics::ModelStatus::kOk)
        return report;
      tips.push_back(tip.pose);
    }
    const TrajectoryPoint there = positionsAt(spec_, [&](int arm) { return tips[at(arm)]; });
    report.tip = there.tip;
    report.actual_relative = there.relative;
    report.error = (report.tip - point.tip).norm();
    report.relative_error = (report.actual_relative - point.relative).norm();
    if (report.reach != Reach::kCancelled && report.reach != Reach::kReconfiguration &&
        std::max(report.error, report.relative_error) <= options_.accept)
      report.reach = Reach::kReached;
    return report;
  }

  const Arms& arms_;
  const TrajectorySpec& spec_;
  const FeasibilityOptions& options_;
  InverseKinematics near_, far_, judge_;
  StepPath step_path_;
  std::vector<kinematics::Branch> branches_;
  TrajectoryPoint last_;  ///< present position of the tips
  Reach edge_ = Reach::kReached;
};

}  // namespace

int FeasibilityReport::unreachable() const {
  return static_cast<int>(
      std::count_if(points.begin(), points.end(), [](const auto& p) { return p.reach != Reach::kReached; }));
}

Eigen::MatrixXd FeasibilityReport::pathFrom(const safety::RobotVector& start_joints) const {
  Eigen::MatrixXd path(start_joints.size(), static_cast<Eigen::Index>(points.size()) + 1);
  path.col(0) = start_joints;
  for (std::size_t k = 0; k < points.size(); ++k)
    path.col(static_cast<Eigen::Index>(k) + 1) = points[k].q;
  return path;
}

std::vector<safety::RobotVector> FeasibilityReport::path() const {
  std::vector<safety::RobotVector> path;
  for (const PointReport& point : points)
    path.push_back(point.q);
  return path;
}

FeasibilityReport checkTrajectory(const Arms& arms,
                                  const TrajectorySpec& trajectory,
                                  const safety::RobotVector& start,
                                  const FeasibilityOptions& options) {
  constexpr double kSingular = 1e-5;  // m/rad
  FeasibilityReport report;
  TrajectorySpec spec = trajectory.ofPositions();
  if (std::string wrong = trajectory.wrongArms(arms.count()); !wrong.empty()) {
    report.start = "the trajectory's arms: " + wrong;
    return report;
  }
  if (report.start = trajectory.wrongModels(arms.models); !report.start.empty())
    return report;
  Start begin = lookAt(arms, start, options.ik.demands);
  report.start = begin.wrong;
  if (!begin.wrong.empty())
    return report;
  try {
    setInsertion(arms, start, spec);
  } catch (const std::invalid_argument& error) {
    report.start = error.what();
    return report;
  }
  const TrajectoryPoint first_place = positionsAt(spec, [&](int arm) { return begin.tips[at(arm)].pose; });
  report.rotation_conditioning = std::numeric_limits<double>::infinity();
  for (const int arm : spec.arms())
    report.rotation_conditioning = std::min(report.rotation_conditioning, rotationConditioning(begin.tips[at(arm)]));
  report.planar_start = report.rotation_conditioning < kSingular;
  const std::vector<TrajectoryPoint> points = sample(spec, first_place);
  const std::vector<kinematics::Branch> branches = begin.branches;
  Walker walker(arms, spec, options, std::move(begin));
  safety::RobotVector q = start;
  report.start = walker.unmetAtStart(q);
  if (!report.start.empty())
    return report;
  for (std::size_t k = 0; k < points.size(); ++k) {
    PointReport point = walker.step(static_cast<int>(k) + 1, points[k], q);
    if (point.reach == Reach::kCancelled) {
      report.cancelled = true;
      return report;
    }
    const bool first = point.reach != Reach::kReached && report.unreachable() == 0;
    q = point.q;
    report.points.push_back(std::move(point));
    // Point-by-point minimisation may lead to a dead end that control, which moves continuously, avoids.
    if (std::vector<PointReport> walked; first && walker.walkAll(first_place, points, start, branches, walked)) {
      report.points = std::move(walked);
      if (options.progress)
        options.progress(static_cast<int>(points.size()), static_cast<int>(points.size()));
      break;
    }
    if (options.progress)
      options.progress(static_cast<int>(k) + 1, static_cast<int>(points.size()));
    if (options.stop_after > 0 && report.unreachable() >= options.stop_after)
      break;
  }
  report.feasible = report.unreachable() == 0;
  return report;
}

}  // namespace tandem::planning
