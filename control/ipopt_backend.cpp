// SPDX-License-Identifier: Apache-2.0
#include "control/detail/ipopt_backend.h"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::control {
namespace {

using Ipopt::Index;
using Ipopt::Number;

/** The QP as a nonlinear problem: constraints are the equalities, then the rows; all matrices dense.
 *
 * Ipopt's tolerances are absolute, joint velocities are thousandths: Ipopt solves for y = x / kUnit with the objective
 * times factor_, so that the gradient at the start is of the order of one. */
class QpAsNlp final : public Ipopt::TNLP {
 public:
  QpAsNlp(const QuadraticProgram& qp, QpSolution& solution) : qp_(qp), solution_(solution) {
    const double gradient = kUnit * (qp.g.cwiseAbs().maxCoeff() + kUnit * qp.H.cwiseAbs().maxCoeff());
    factor_ = gradient > 0.0 ? 1.0 / gradient : 1.0;
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_h, IndexStyleEnum& style) override {
    n = qp_.variables();
    m = qp_.equalities() + qp_.rows();
    nnz_jac = m * n;
    nnz_h = n * (n + 1) / 2;
    style = TNLP::C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* g_lower, Number* g_upper) override {
    for (Index i = 0; i < n; ++i) {
      lower[i] = std::max(qp_.lower[i] / kUnit, -kInfinity);
      upper[i] = std::min(qp_.upper[i] / kUnit, kInfinity);
    }
    for (Index j = 0; j < m; ++j) {
      const bool equality = j < qp_.equalities();
      g_lower[j] = equality ? qp_.e[j] / kUnit : -kInfinity;
      g_upper[j] = equality ? qp_.e[j] / kUnit : std::min(qp_.b[j - qp_.equalities()] / kUnit, kInfinity);
    }
    return true;
  }

  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) override {
    for (Index i = 0; i < n; ++i)
      x[i] = std::clamp(0.0, qp_.lower[i], qp_.upper[i]) / kUnit;
    return true;
  }

  bool eval_f(Index n, const Number* x, bool, Number& value) override {
    const Eigen::Map<const Eigen::VectorXd> v(x, n);
    value = factor_ * kUnit * (0.5 * kUnit * v.dot(qp_.H * v) + qp_.g.dot(v));
    return true;
  }

  bool eval_grad_f(Index n, const Number* x, bool, Number* gradient) override {
    const Eigen::Map<const Eigen::VectorXd> v(x, n);
    Eigen::Map<Eigen::VectorXd>(gradient, n) = factor_ * kUnit * (kUnit * (qp_.H * v) + qp_.g);
    return true;
  }

  bool eval_g(Index n, const Number* x, bool, Index, Number* g) override {
    const Eigen::Map<const Eigen::VectorXd> v(x, n);
    for (int j = 0; j < qp_.equalities(); ++j)
      g[j] = qp_.E.row(j).dot(v);
    for (int j = 0; j < qp_.rows(); ++j)
      g[qp_.equalities() + j] = qp_.A.row(j).dot(v);
    return true;
  }

  bool eval_jac_g(Index n, const Number*, bool, Index m, Index, Index* row, Index* col, Number* values) override {
    for (Index j = 0, k = 0; j < m; ++j) {
      for (Index i = 0; i < n; ++i, ++k) {
        if (values == nullptr) {
          row[k] = j;
          col[k] = i;
        } else {
          values[k] = j < qp_.equalities() ? qp_.E(j, i) : qp_.A(j - qp_.equalities(), i);
        }
      }
    }
    return true;
  }

  bool eval_h(Index n,
              const Number*,
              bool,
              Number factor,
              Index,
              const Number*,
              bool,
              Index,
              Index* row,
              Index* col,
              Number* values) override {
    for (Index j = 0, k = 0; j < n; ++j) {
      for (Index i = 0; i <= j; ++i, ++k) {
        if (values == nullptr) {
          row[k] = j;
          col[k] = i;
        } else {
          values[k] = factor * factor_ * kUnit * kUnit * qp_.H(j, i);
        }
      }
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn,
                         Index n,
                         const Number* x,
                         const Number* z_lower,
                         const Number* z_upper,
                         Index,
                         const Number*,
                         const Number* lambda,
                         Number,
                         const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    const double multiplier = 1.0 / (factor_ * kUnit);
    for (Index i = 0; i < n; ++i) {
      solution_.x[i] = std::clamp(kUnit * x[i], qp_.lower[i], qp_.upper[i]);
      solution_.z[i] = multiplier * (z_upper[i] - z_lower[i]);
    }
    for (int j = 0; j < qp_.equalities(); ++j)
      solution_.y[j] = multiplier * lambda[j];
    for (int j = 0; j < qp_.rows(); ++j)
      solution_.w[j] = multiplier * lambda[qp_.equalities() + j];
  }

 private:
  static constexpr double kInfinity = 2e19;  // Ipopt's value for no bound
  static constexpr double kUnit = 1e-3;      // m/s, magnitude of joint velocities
  const QuadraticProgram& qp_;
  QpSolution& solution_;
  double factor_ = 1.0;
};

QpStatus statusOf(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Solved_To_Acceptable_Level:
      return QpStatus::kSolved;
    case Ipopt::Infeasible_Problem_Detected:
      return QpStatus::kInfeasible;
    case Ipopt::Maximum_Iterations_Exceeded:
      return QpStatus::kIterationLimit;
    default:
      return QpStatus::kFailed;
  }
}

}  // namespace

void IpoptBackend::solve(const QuadraticProgram& qp, QpSolution& solution) noexcept {
  const int n = qp.variables();
  solution.x.setZero(n);
  solution.y.setZero(qp.equalities());
  solution.z.setZero(n);
  solution.w.setZero(qp.rows());
  solution.iterations = 0;
  solution.residual = std::numeric_limits<double>::infinity();
  solution.crossed = -1;
  if ((qp.lower.array() > qp.upper.array()).any()) {
    solution.status = QpStatus::kInfeasible;
    return;
  }
  try {
    Ipopt::SmartPtr<Ipopt::IpoptApplication> app = new Ipopt::IpoptApplication(false);
    app->Options()->SetStringValue("sb", "yes");
    app->Options()->SetIntegerValue("print_level", 0);
    app->Options()->SetNumericValue("tol", 1e-10);
    app->Options()->SetNumericValue("constr_viol_tol", 1e-10);
    app->Options()->SetNumericValue("dual_inf_tol", 1e-10);
    app->Options()->SetNumericValue("compl_inf_tol", 1e-10);
    app->Options()->SetNumericValue("bound_relax_factor", 0.0);
    app->Options()->SetStringValue("jac_c_constant", "yes");
    app->Options()->SetStringValue("jac_d_constant", "yes");
    app->Options()->SetStringValue("hessian_constant", "yes");
    app->Options()->SetStringValue("mehrotra_algorithm", "yes");
    app->Options()->SetStringValue("fixed_variable_treatment", "make_constraint");
    // Ignores ipopt.opt in the working folder.
    if (app->Initialize(std::string()) != Ipopt::Solve_Succeeded) {
      solution.status = QpStatus::kFailed;
      return;
    }
    Ipopt::SmartPtr<Ipopt::TNLP> nlp = new QpAsNlp(qp, solution);
    solution.status = statusOf(app->OptimizeTNLP(nlp));
    if (Ipopt::IsValid(app->Statistics()))
      solution.iterations = app->Statistics()->IterationCount();
  } catch (...) {
    solution.status = QpStatus::kFailed;
  }
  if (!solution.x.allFinite())
    solution.status = QpStatus::kFailed;
  if (solution.status == QpStatus::kSolved)
    solution.residual = kktResidual(qp, solution);
}

}  // namespace tandem::control
