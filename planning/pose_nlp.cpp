// SPDX-License-Identifier: Apache-2.0
#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>

#include <algorithm>
#include <cmath>

#include "planning/detail/cancellable_nlp.h"
#include "planning/detail/pose_solvers.h"

namespace tandem::planning {
namespace {

using Ipopt::Index;
using Ipopt::Number;

/** Ipopt interface of PoseProblem: over z, all matrices dense. */
class PoseNlp final : public CancellableNlp {
 public:
  PoseNlp(const PoseProblem& problem,
          const safety::RobotVector& start,
          const std::function<bool()>& cancelled,
          PoseSolution& solution)
      : CancellableNlp(cancelled), problem_(problem), solution_(solution), unit_(start.size()) {
    for (int j = 0; j < start.size(); ++j)
      unit_[j] = PoseProblem::unit(*problem.arms, j);
    start_ = start.cwiseQuotient(unit_);
    point_ = evaluate(problem_, start);
    at_ = start;
    rows_ = point_.constraints.size();
    first_objective_ = point_.objective;
  }

  bool startAnswered() const { return point_.answered; }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_h, IndexStyleEnum& style) override {
    n = static_cast<Index>(unit_.size());
    m = static_cast<Index>(rows_);
    nnz_jac = m * n;
    nnz_h = n * (n + 1) / 2;
    style = TNLP::C_STYLE;
    return true;
  }

  bool get_bounds_info(Index, Number* lower, Number* upper, Index m, Number* g_lower, Number* g_upper) override {
    for (int j = 0; j < unit_.size(); ++j) {
      const safety::Interval box = problem_.box(j);
      lower[j] = std::max(box.lower / unit_[j], -kInfinity);
      upper[j] = std::min(box.upper / unit_[j], kInfinity);
    }
    Eigen::Map<Eigen::VectorXd>(g_lower, m) = point_.lower;
    Eigen::Map<Eigen::VectorXd>(g_upper, m) = point_.upper;
    return true;
  }

  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) override {
    Eigen::Map<Eigen::VectorXd>(x, n) = start_;
    return true;
  }

  /// Scales the objective, which is large for distant targets, to a gradient of the order of one for Ipopt's
  /// tolerances.
  bool get_scaling_parameters(Number& objective, bool& x, Index, Number*, bool& g, Index, Number*) override {
    objective = problem_.nearest ? 1.0 / std::max(1.0, std::sqrt(2.0 * first_objective_)) : 1.0;
    x = g = false;
    return true;
  }

  bool eval_f(Index, const Number* x, bool fresh, Number& value) override {
    if (!update(x, fresh))
      return false;
    value = point_.objective;
    return true;
  }

  bool eval_grad_f(Index n, const Number* x, bool fresh, Number* gradient) override {
    if (!update(x, fresh))
      return false;
    Eigen::Map<Eigen::VectorXd>(gradient, n) = point_.gradient;
    return true;
  }

  bool eval_g(Index, const Number* x, bool fresh, Index m, Number* g) override {
    if (!update(x, fresh))
      return false;
    Eigen::Map<Eigen::VectorXd>(g, m) = point_.constraints;
    return true;
  }

  bool eval_jac_g(Index n, const Number* x, bool fresh, Index m, Index, Index* row, Index* col, Number* values)
      override {
    if (values == nullptr) {
      for (Index j = 0, k = 0; j < m; ++j) {
        for (Index i = 0; i < n; ++i, ++k)
          row[k] = j, col[k] = i;
      }
      return true;
    }
    if (!update(x, fresh))
      return false;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(values, m, n) = point_.jacobian;
    return true;
  }

  bool eval_h(Index n,
              const Number* x,
              bool,
              Number factor,
              Index m,
              const Number* lambda,
              bool,
              Index,
              Index* row,
              Index* col,
              Number* values) override {
    Eigen::MatrixXd hessian;
    if (values != nullptr) {
      const Eigen::VectorXd multipliers = Eigen::Map<const Eigen::VectorXd>(lambda, m);
      hessian = curvature(problem_, joints(x), factor, multipliers);
      if (!hessian.allFinite())
        return false;
    }
    for (Index j = 0, k = 0; j < n; ++j) {
      for (Index i = 0; i <= j; ++i, ++k) {
        if (values == nullptr)
          row[k] = j, col[k] = i;
        else
          values[k] = hessian(j, i);
      }
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn,
                         Index n,
                         const Number* x,
                         const Number* z_lower,
                         const Number* z_upper,
                         Index m,
                         const Number*,
                         const Number* lambda,
                         Number,
                         const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    solution_.q = joints(x);
    for (int j = 0; j < unit_.size(); ++j) {
      const safety::Interval box = problem_.box(j);
      solution_.q[j] = std::clamp(solution_.q[j], box.lower, box.upper);  // rounding of the units
    }
    solution_.multipliers = Eigen::Map<const Eigen::VectorXd>(lambda, m);
    solution_.joint_multipliers =
        Eigen::Map<const Eigen::VectorXd>(z_upper, n) - Eigen::Map<const Eigen::VectorXd>(z_lower, n);
  }

 private:
  safety::RobotVector joints(const Number* x) const {
    return Eigen::Map<const Eigen::VectorXd>(x, unit_.size()).cwiseProduct(unit_);
  }
  bool update(const Number* x, bool) {
    const safety::RobotVector q = joints(x);
    if (q != at_) {
      point_ = evaluate(problem_, q);
      at_ = q;
    }
    return point_.answered;
  }

  static constexpr double kInfinity = 2e19;
  const PoseProblem& problem_;
  PoseSolution& solution_;
  Eigen::VectorXd unit_, start_;
  safety::RobotVector at_;
  PosePoint point_;
  Eigen::Index rows_ = 0;
  double first_objective_ = 0.0;
};

}  // namespace

PoseSolution solveByIpopt(const PoseProblem& problem,
                          const safety::RobotVector& start,
                          int max_iterations,
                          const std::function<bool()>& cancelled) {
  PoseSolution solution;
  solution.q = start;
  const Ipopt::SmartPtr<PoseNlp> nlp = new PoseNlp(problem, start, cancelled, solution);
  if (!nlp->startAnswered())
    return solution;
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> app = new Ipopt::IpoptApplication(false);
  const auto options = app->Options();
  options->SetStringValue("sb", "yes");
  options->SetIntegerValue("print_level", 0);
  options->SetIntegerValue("max_iter", max_iterations);
  options->SetNumericValue("tol", 1e-9);
  options->SetNumericValue("constr_viol_tol", 1e-9);
  options->SetNumericValue("compl_inf_tol", 1e-9);
  options->SetNumericValue("acceptable_tol", 1e-7);
  options->SetNumericValue("acceptable_constr_viol_tol", 1e-7);
  options->SetIntegerValue("acceptable_iter", 8);
  options->SetNumericValue("bound_relax_factor", 0.0);
  // Starts are usually good: keeps them near the bounds that they are at.
  options->SetNumericValue("bound_push", 1e-4);
  options->SetNumericValue("bound_frac", 1e-4);
  options->SetNumericValue("mu_init", 1e-3);
  options->SetStringValue("nlp_scaling_method", "user-scaling");
  // Ignores ipopt.opt in the working folder.
  if (app->Initialize(std::string()) != Ipopt::Solve_Succeeded)
    return solution;
  const Ipopt::SmartPtr<Ipopt::TNLP> base = Ipopt::GetRawPtr(nlp);
  const Ipopt::ApplicationReturnStatus status = app->OptimizeTNLP(base);
  solution.cancelled = nlp->wasCancelled();
  solution.solved = status == Ipopt::Solve_Succeeded || status == Ipopt::Solved_To_Acceptable_Level;
  solution.iteration_limit = status == Ipopt::Maximum_Iterations_Exceeded;
  if (Ipopt::IsValid(app->Statistics()))
    solution.iterations = app->Statistics()->IterationCount();
  if (!solution.q.allFinite())
    solution.q = start, solution.solved = false;
  return solution;
}

}  // namespace tandem::planning
