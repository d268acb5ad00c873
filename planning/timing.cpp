// SPDX-License-Identifier: Apache-2.0
#include "planning/timing.h"

#include <IpIpoptApplication.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/detail/cancellable_nlp.h"

namespace tandem::planning {
namespace {

using Ipopt::Index;
using Ipopt::Number;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Limit of a joint: the wanted one, else the robot's, else `otherwise`.
double chosen(double wanted, double by_robot, double otherwise) {
  return wanted > 0.0 ? wanted : std::isfinite(by_robot) ? by_robot : otherwise;
}

/// Largest x of each point from the velocity limits; infinite without motion.
Eigen::VectorXd largest(const TimingProblem& problem) {
  const Eigen::Index last = problem.path.cols() - 1;
  Eigen::VectorXd x = Eigen::VectorXd::Constant(last + 1, kInfinity);
  for (Eigen::Index k = 0; k < last; ++k) {
    const Eigen::VectorXd step = (problem.path.col(k + 1) - problem.path.col(k)).cwiseAbs();
    for (Eigen::Index j = 0; j < step.size(); ++j) {
      const double rate = step[j] > 0.0 ? problem.velocity[j] / step[j] : kInfinity;
      x[k] = std::min(x[k], rate * rate);
      x[k + 1] = std::min(x[k + 1], rate * rate);
    }
  }
  return x;
}

/** One acceleration constraint: a x_k + b x_(k+1) within [-1, 1]. */
struct Row {
  int k;
  double a, b;
};

/** The convex problem over y_k = x_k / largest x_k. */
class TimingNlp final : public CancellableNlp {
 public:
  TimingNlp(const TimingProblem& problem, const std::function<bool()>& cancelled, Eigen::VectorXd& x)
      : CancellableNlp(cancelled), x_(x) {
    // Scale for points without an active velocity limit.
    double known = 0.0;
    for (const double value : x_)
      known = std::isfinite(value) ? std::max(known, value) : known;
    for (double& value : x_)
      value = std::isfinite(value) ? value : (known > 0.0 ? 1e4 * known : 1.0);
    unlimited_ = known == 0.0;
    const auto last = static_cast<int>(x_.size()) - 1;
    for (int k = 0; k < last; ++k) {
      addRows(problem, k, k);
      addRows(problem, k, k + 1);
    }
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_h, IndexStyleEnum& style) override {
    n = static_cast<Index>(x_.size());
    m = static_cast<Index>(rows_.size());
    nnz_jac = 2 * m;
    nnz_h = 2 * n - 1;
    style = TNLP::C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* g_lower, Number* g_upper) override {
    for (Index k = 0; k < n; ++k) {
      const bool end = k == 0 || k + 1 == n;
      lower[k] = end ? 0.0 : kLeast;
      upper[k] = end ? 0.0 : unlimited_ ? 2e19 : 1.0;
    }
    std::fill(g_lower, g_lower + m, -1.0);
    std::fill(g_upper, g_upper + m, 1.0);
    return true;
  }

  bool get_starting_point(Index n, bool, Number* y, bool, Number*, Number*, Index, bool, Number*) override {
    // So slow that no acceleration limit is active.
    double scale = 1.0;
    for (const Row& row : rows_)
      scale = std::min(scale, 0.5 / std::max(1e-300, std::abs(row.a) * x_[row.k] + std::abs(row.b) * x_[row.k + 1]));
    for (Index k = 0; k < n; ++k)
      y[k] = k == 0 || k + 1 == n ? 0.0 : std::max(scale, 2.0 * kLeast);
    return true;
  }

  bool eval_f(Index n, const Number* y, bool, Number& value) override {
    value = 0.0;
    for (Index k = 0; k + 1 < n; ++k)
      value += 2.0 / (root(y, k) + root(y, k + 1));
    return std::isfinite(value);
  }

  bool eval_grad_f(Index n, const Number* y, bool, Number* gradient) override {
    std::fill(gradient, gradient + n, 0.0);
    for (Index k = 0; k + 1 < n; ++k) {
      const double sum = root(y, k) + root(y, k + 1);
      for (const Index i : {k, k + 1})
        gradient[i] -= slope(y, i, n) * 2.0 / (sum * sum);
    }
    return true;
  }

  bool eval_g(Index, const Number* y, bool, Index m, Number* g) override {
    for (Index i = 0; i < m; ++i)
      g[i] = rows_[i].a * x_[rows_[i].k] * y[rows_[i].k] + rows_[i].b * x_[rows_[i].k + 1] * y[rows_[i].k + 1];
    return true;
  }

  bool eval_jac_g(Index, const Number*, bool, Index m, Index, Index* row, Index* col, Number* values) override {
    for (Index i = 0; i < m; ++i) {
      for (const Index side : {0, 1}) {
        if (values == nullptr)
          row[2 * i + side] = i, col[2 * i + side] = rows_[i].k + side;
        else
          values[2 * i + side] = (side == 0 ? rows_[i].a : rows_[i].b) * x_[rows_[i].k + side];
      }
    }
    return true;
  }

  /// Tridiagonal: f_k = 2 / (r_k + r_k+1), r = sqrt(x).
  bool eval_h(Index n,
              const Number* y,
              bool,
              Number factor,
              Index,
              const Number*,
              bool,
              Index,
              Index* row,
              Index* col,
              Number* values) override {
    if (values == nullptr) {
      for (Index k = 0; k < n; ++k)
        row[k] = col[k] = k;
      for (Index k = 0; k + 1 < n; ++k)
        row[n + k] = k + 1, col[n + k] = k;
      return true;
    }
    std::fill(values, values + 2 * n - 1, 0.0);
    for (Index k = 0; k + 1 < n; ++k) {
      const double sum = root(y, k) + root(y, k + 1), d1 = -2.0 / (sum * sum), d2 = 4.0 / (sum * sum * sum);
      for (const Index i : {k, k + 1}) {
        const double s = slope(y, i, n);
        const double bend = s > 0.0 ? -0.5 * s / y[i] : 0.0;  // second derivative of the root
        values[i] += factor * (d2 * s * s + d1 * bend);
      }
      values[n + k] += factor * d2 * slope(y, k, n) * slope(y, k + 1, n);
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn,
                         Index n,
                         const Number* y,
                         const Number*,
                         const Number*,
                         Index,
                         const Number*,
                         const Number*,
                         Number,
                         const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    for (Index k = 0; k < n; ++k)
      x_[k] *= std::max(0.0, y[k]);
  }

 private:
  static constexpr double kLeast = 1e-12;

  double root(const Number* y, Index k) const { return std::sqrt(std::max(0.0, y[k]) * x_[k]); }
  /// d sqrt(x_k) / d y_k; zero at the ends, where the speed is zero.
  double slope(const Number* y, Index k, Index n) const {
    return k == 0 || k + 1 == n ? 0.0 : 0.5 * x_[k] / root(y, k);
  }

  /// Acceleration constraints of all joints in segment k at the point `at` (k or k + 1).
  void addRows(const TimingProblem& problem, int k, int at) {
    const auto last = static_cast<int>(problem.path.cols()) - 1;
    const int before = std::max(0, at - 1), after = std::min(last, at + 1);
    const Eigen::VectorXd slope = (problem.path.col(after) - problem.path.col(before)) / (after - before);
    Eigen::VectorXd bend = Eigen::VectorXd::Zero(slope.size());
    if (after - before == 2)
      bend = problem.path.col(after) - 2.0 * problem.path.col(at) + problem.path.col(before);
    for (Eigen::Index j = 0; j < slope.size(); ++j) {
      const double most = problem.acceleration[j];
      if (!std::isfinite(most) || (slope[j] == 0.0 && bend[j] == 0.0))
        continue;
      const double a = -0.5 * slope[j] + (at == k ? bend[j] : 0.0), b = 0.5 * slope[j] + (at == k ? 0.0 : bend[j]);
      rows_.push_back({k, a / most, b / most});
    }
  }

  Eigen::VectorXd& x_;  ///< scales, then the solution
  std::vector<Row> rows_;
  bool unlimited_ = false;
};

TimingStatus solve(const TimingProblem& problem, const std::function<bool()>& cancelled, Eigen::VectorXd& x) {
  const Ipopt::SmartPtr<Ipopt::TNLP> nlp = new TimingNlp(problem, cancelled, x);
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> app = new Ipopt::IpoptApplication(false);
  app->Options()->SetStringValue("sb", "yes");
  app->Options()->SetIntegerValue("print_level", 0);
  app->Options()->SetIntegerValue("max_iter", 500);
  app->Options()->SetNumericValue("tol", 1e-9);
  app->Options()->SetNumericValue("bound_relax_factor", 0.0);
  app->Options()->SetStringValue("mu_strategy", "adaptive");
  app->Options()->SetStringValue("jac_d_constant", "yes");
  // Ignores ipopt.opt in the working folder.
  if (app->Initialize(std::string()) != Ipopt::Solve_Succeeded)
    return TimingStatus::kInvalid;
  switch (app->OptimizeTNLP(nlp)) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Solved_To_Acceptable_Level:
      return TimingStatus::kOptimal;
    case Ipopt::User_Requested_Stop:
      return TimingStatus::kCancelled;
    default:
      return TimingStatus::kIterationLimit;
  }
}

bool valid(const TimingProblem& problem) {
  const auto joints = problem.path.rows();
  const auto above = [](const Eigen::VectorXd& v) { return (v.array() > 0.0).all(); };
  return problem.path.cols() >= 2 && problem.path.allFinite() && problem.velocity.size() == joints &&
         problem.acceleration.size() == joints && above(problem.velocity) && above(problem.acceleration);
}

}  // namespace

TimingProblem timingProblem(const std::vector<const safety::ArmLimits*>& arms,
                            Eigen::MatrixXd path,
                            const TimingLimits& wanted) {
  TimingProblem problem;
  problem.path = std::move(path);
  problem.velocity.resize(problem.path.rows());
  problem.acceleration.resize(problem.path.rows());
  Eigen::Index j = 0;
  for (const safety::ArmLimits* limits : arms) {
    for (int k = 0; k < limits->jointCount(); ++k, ++j) {
      const safety::JointLimit& limit = limits->joints[static_cast<std::size_t>(k)];
      const bool translation = limits->isTranslation(k);
      problem.velocity[j] =
          chosen(translation ? 0.0 : wanted.rotation_velocity, limit.velocity, wanted.free_rotation_velocity);
      problem.acceleration[j] = chosen(translation ? wanted.translation_acceleration : wanted.rotation_acceleration,
                                       limit.slew_limit, safety::kUnlimited);
    }
  }
  return problem;
}

Timing timeOptimal(const TimingProblem& problem, const std::function<bool()>& cancelled) {
  Timing timing;
  if (!valid(problem))
    return timing;
  const Eigen::Index last = problem.path.cols() - 1;
  Eigen::VectorXd x = largest(problem);
  const bool accelerates = problem.acceleration.array().isFinite().any();
  // Two points have no free variable between the ends.
  const bool optimise = accelerates && last >= 2;
  timing.status = optimise ? solve(problem, cancelled, x) : TimingStatus::kOptimal;
  if (timing.status != TimingStatus::kOptimal)
    return timing;
  timing.time.assign(1, 0.0);
  for (Eigen::Index k = 0; k < last; ++k) {
    const Eigen::VectorXd step = (problem.path.col(k + 1) - problem.path.col(k)).cwiseAbs();
    Eigen::Index joint;
    double piece = step.cwiseQuotient(problem.velocity).maxCoeff(&joint);
    if (!optimise && piece == 0.0 && step.maxCoeff() > 0.0)
      timing.status = TimingStatus::kUnlimited;
    timing.limiting.push_back(static_cast<int>(joint));
    double needed = piece;
    if (optimise)
      needed = step.maxCoeff() > 0.0 ? 2.0 / (std::sqrt(x[k]) + std::sqrt(x[k + 1])) : 0.0;
    else if (accelerates)  // from standstill to standstill over one segment: triangular or trapezoidal speed
      for (Eigen::Index j = 0; j < step.size(); ++j) {
        const double a = problem.acceleration[j], v = problem.velocity[j];
        needed = std::max(needed, step[j] < v * v / a ? 2.0 * std::sqrt(step[j] / a) : step[j] / v + v / a);
      }
    if (needed > piece * (1.0 + 1e-3))
      timing.limiting.back() = -1;
    timing.time.push_back(timing.time.back() + needed);
  }
  return timing;
}

}  // namespace tandem::planning
