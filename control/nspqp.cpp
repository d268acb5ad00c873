// SPDX-License-Identifier: Apache-2.0
#include "control/methods.h"
#include "control/qp_methods.h"

namespace tandem::control {
namespace {

/** Null-space projection as a constrained QP, Alsaka et al. 2024, (7):
 *
 *   min over qdot   1/2 qdot^T (J_m^T J_m + zeta I) qdot - v_m^T J_m qdot
 *   s.t.            J_k qdot = v_k  for all tasks k before the last one, m,
 *                   lower <= qdot <= upper,   a_i^T qdot <= rate_i  (coupled rows; none with frozen bounds).
 *
 * Rotations are bounded only where the robot file gives them a velocity or travel. Infeasible where the limits forbid a
 * task above the last: the paper's method has no answer then, and neither has this one. */
class Nspqp final : public Resolver {
 public:
  explicit Nspqp(const MethodParameters& parameters)
      : Resolver(parameters), backend_(makeQpBackend(parameters.backend)) {}
  Method method() const override { return Method::kNspqp; }
  void reset() noexcept override { backend_->reset(); }

 private:
  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    const int n = problem.joint_count;
    velocityBounds(problem, parameters_.bounds, parameters_.period, solution.bounds);
    const int last = problem.task_count - 1;
    int equalities = 0;
    for (int k = 0; k < last; ++k)
      equalities += static_cast<int>(problem.task[k].velocity.size());
    qp_.resize(n, equalities, solution.bounds.row_count);
    addLimits(problem, solution.bounds, qp_);
    for (int k = 0, row = 0; k < last; ++k) {
      const int size = static_cast<int>(problem.task[k].velocity.size());
      qp_.E.middleRows(row, size) = problem.task[k].jacobian;
      qp_.e.segment(row, size) = problem.task[k].velocity;
      row += size;
    }
    if (last >= 0) {
      const Task& task = problem.task[last];
      qp_.H = task.jacobian.transpose().lazyProduct(task.jacobian);
      qp_.g = -(task.jacobian.transpose().lazyProduct(task.velocity));
    }
    qp_.H.diagonal().array() += parameters_.nspqp_zeta;
    backend_->solve(qp_, qp_solution_);
    solution.iterations = qp_solution_.iterations;
    if (qp_solution_.status != QpStatus::kSolved)
      return statusOf(qp_solution_.status);
    solution.velocity = qp_solution_.x;
    solution.kkt_residual = kktResidual(qp_, qp_solution_);
    for (int k = 0; k < problem.task_count; ++k)
      solution.scale[k] = 1.0;
    return SolveStatus::kSolved;
  }

  std::unique_ptr<QpBackend> backend_;
  QuadraticProgram qp_;
  QpSolution qp_solution_;
};

}  // namespace

std::unique_ptr<Resolver> makeNspqp(const MethodParameters& parameters) { return std::make_unique<Nspqp>(parameters); }

}  // namespace tandem::control
