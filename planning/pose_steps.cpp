// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "control/quadratic_program.h"
#include "planning/detail/pose_solvers.h"

namespace tandem::planning {
namespace {

constexpr double kConverged = 1e-9;  ///< step and constraints, in the units of the problem
constexpr int kMostSteps = 40;
constexpr double kShorter = 0.5;  ///< a step is expected to be shorter than this share of the one before it
constexpr double kNone = 1e19;    ///< bounds beyond this are none

/// a d <= b.
struct Bound {
  Eigen::RowVectorXd a;
  double b = 0.0;
};

/** Quadratic programme of one step. */
class StepProgram {
 public:
  StepProgram(const PoseProblem& problem, const safety::RobotVector& start)
      : problem_(problem), unit_(start.size()), backend_(control::makeQpBackend(control::Backend::kActiveSet)) {
    for (int j = 0; j < start.size(); ++j)
      unit_[j] = PoseProblem::unit(*problem.arms, j);
  }

  /// @param q  the present joints. @return false: no step satisfies the constraints to first order.
  bool solve(const PosePoint& point, const safety::RobotVector& q) {
    if (!set(point, q))
      return false;
    backend_->solve(program_, solution_);
    return solution_.status == control::QpStatus::kSolved;
  }

  double length() const { return solution_.x.cwiseAbs().maxCoeff(); }
  double slope(const PosePoint& point) const { return point.gradient.dot(solution_.x); }
  double largestMultiplier() const {
    const double rows = solution_.w.size() > 0 ? solution_.w.cwiseAbs().maxCoeff() : 0.0;
    return std::max(rows, solution_.y.cwiseAbs().maxCoeff());
  }
  safety::RobotVector moved(const safety::RobotVector& q, double share) const {
    safety::RobotVector there = q;
    for (int j = 0; j < unit_.size(); ++j) {
      const safety::Interval box = problem_.box(j);
      there[j] = std::clamp(q[j] + share * unit_[j] * solution_.x[j], box.lower, box.upper);
    }
    return there;
  }

  /// Multipliers of the last step.
  void report(PoseSolution& solution, Eigen::Index rows) const {
    solution.multipliers = Eigen::VectorXd::Zero(rows);
    for (std::size_t i = 0; i < equal_.size(); ++i)
      solution.multipliers[equal_[i]] += solution_.y[static_cast<Eigen::Index>(i)];
    for (std::size_t i = 0; i < bounds_.size(); ++i)
      solution.multipliers[bounded_[i]] += sign_[i] * solution_.w[static_cast<Eigen::Index>(i)];
    solution.joint_multipliers = solution_.z;
  }

 private:
  void bound(Eigen::Index row, double sign, Bound bound) {
    bounded_.push_back(row);
    sign_.push_back(sign);
    bounds_.push_back(std::move(bound));
  }

  void collect(const PosePoint& point) {
    equal_.clear();
    bounded_.clear();
    sign_.clear();
    bounds_.clear();
    for (Eigen::Index k = 0; k < point.constraints.size(); ++k) {
      if (point.lower[k] == point.upper[k]) {
        equal_.push_back(k);
        continue;
      }
      if (point.upper[k] < kNone)
        bound(k, 1.0, {point.jacobian.row(k), point.upper[k] - point.constraints[k]});
      if (point.lower[k] > -kNone)
        bound(k, -1.0, {-point.jacobian.row(k), point.constraints[k] - point.lower[k]});
    }
  }

  /// @return false: the programme is too large for the solver.
  bool set(const PosePoint& point, const safety::RobotVector& q) {
    collect(point);
    if (unit_.size() > control::kMaxVariables || equal_.size() > control::kMaxEqualities ||
        bounds_.size() > control::kMaxInequalities)
      return false;
    program_.resize(static_cast<int>(unit_.size()), static_cast<int>(equal_.size()), static_cast<int>(bounds_.size()));
    program_.H.setIdentity();
    program_.g = point.gradient;
    for (int j = 0; j < unit_.size(); ++j) {
      const safety::Interval box = problem_.box(j);
      program_.lower[j] = (box.lower - q[j]) / unit_[j];
      program_.upper[j] = (box.upper - q[j]) / unit_[j];
    }
    for (std::size_t i = 0; i < equal_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      program_.E.row(row) = point.jacobian.row(equal_[i]);
      program_.e[row] = point.lower[equal_[i]] - point.constraints[equal_[i]];
    }
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      program_.A.row(static_cast<Eigen::Index>(i)) = bounds_[i].a;
      program_.b[static_cast<Eigen::Index>(i)] = bounds_[i].b;
    }
    return true;
  }

  const PoseProblem& problem_;
  Eigen::VectorXd unit_;
  std::unique_ptr<control::QpBackend> backend_;
  control::QuadraticProgram program_;
  control::QpSolution solution_;
  std::vector<Eigen::Index> equal_, bounded_;  ///< constraints of the programme's equalities and rows
  std::vector<double> sign_;                   ///< of a row: 1 from an upper bound, -1 from a lower one
  std::vector<Bound> bounds_;
};

double violation(const PosePoint& point) {
  return std::max((point.lower - point.constraints).maxCoeff(), (point.constraints - point.upper).maxCoeff());
}

double sumOfViolations(const PosePoint& point) {
  return (point.lower - point.constraints).cwiseMax(point.constraints - point.upper).cwiseMax(0.0).sum();
}

/** Iterates of one search. */
class Search {
 public:
  Search(const PoseProblem& problem, const safety::RobotVector& start)
      : problem_(problem), program_(problem, start), q_(start), point_(evaluate(problem, start)) {}

  bool run() {
    double before = std::numeric_limits<double>::infinity();
    bool measured = false;
    for (int k = 0; k < kMostSteps && point_.answered; ++k, ++steps_) {
      if (!program_.solve(point_, q_))
        return false;
      const double length = program_.length();
      if (length < kConverged && violation(point_) < kConverged)
        return true;
      measured = measured || length > kShorter * before;
      if (!measured)
        move(1.0);
      else if (!descend())
        return meet();
      before = length;
    }
    return false;
  }

  PoseSolution solution() const {
    PoseSolution solution;
    solution.solved = true;
    solution.q = q_;
    solution.iterations = steps_;
    program_.report(solution, point_.constraints.size());
    return solution;
  }

 private:
  void move(double share) {
    q_ = program_.moved(q_, share);
    point_ = evaluate(problem_, q_);
  }

  /// A share of the step that decreases  1/2 |z - z_ref|^2 + mu |violations|_1. @return false: there is none.
  bool descend() {
    constexpr double kLeastShare = 1.0 / 128.0, kEnough = 1e-4;
    const double price = 2.0 * program_.largestMultiplier();
    const auto merit = [price](const PosePoint& point) { return point.objective + price * sumOfViolations(point); };
    const double present = merit(point_);
    const double slope = program_.slope(point_) - price * sumOfViolations(point_);
    for (double share = 1.0; share >= kLeastShare; share *= 0.5) {
      const safety::RobotVector q = program_.moved(q_, share);
      PosePoint trial = evaluate(problem_, q);
      if (!trial.answered || merit(trial) > present + kEnough * share * slope)
        continue;
      q_ = q;
      point_ = std::move(trial);
      return true;
    }
    return false;
  }

  /// The shortest way from the present joints to the constraints, without regard to the reference.
  bool meet() {
    constexpr int kMost = 60;  // across a kink every other step is about half as long
    for (int k = 0; k < kMost && point_.answered; ++k, ++steps_) {
      if (violation(point_) < kConverged)
        return true;
      point_.gradient.setZero();
      if (!program_.solve(point_, q_))
        return false;
      move(1.0);
    }
    return false;
  }

  const PoseProblem& problem_;
  StepProgram program_;
  safety::RobotVector q_;
  PosePoint point_;
  int steps_ = 0;
};

}  // namespace

std::optional<PoseSolution> solveBySteps(const PoseProblem& problem, const safety::RobotVector& start) {
  if (problem.nearest || problem.targets.empty())
    return std::nullopt;
  Search search(problem, start);
  if (!search.run())
    return std::nullopt;
  return search.solution();
}

PoseSolution solve(const PoseProblem& problem,
                   const safety::RobotVector& start,
                   int max_iterations,
                   const std::function<bool()>& cancelled) {
  if (const std::optional<PoseSolution> near = solveBySteps(problem, start))
    return *near;
  return solveByIpopt(problem, start, max_iterations, cancelled);
}

}  // namespace tandem::planning
