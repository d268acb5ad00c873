// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "control/conflict.h"
#include "control/detail/qp_methods.h"
#include "control/methods.h"
#include "control/posture.h"
#include "control/recovery.h"

namespace tandem::control {
namespace {

/** Null-space projection as a constrained QP, Alsaka et al. 2024, (7):
 *
 *   min over qdot   1/2 qdot^T (J_m^T J_m + zeta I) qdot - v_m^T J_m qdot
 *   s.t.            J_k qdot = v_k  for all tasks k before the last one, m,
 *                   lower <= qdot <= upper,   a_i^T qdot <= rate_i  (coupled rows; none with frozen bounds).
 *
 * If the limits forbid a task before the last, the paper's method has no solution. Here the certificate names those
 * limits, and the velocity minimises the error task by task: with v_k replaced by J_k qdot_k,
 *
 *   qdot_k = argmin 1/2 |J_k qdot - v_k|^2 + 1/2 zeta |qdot|^2   s.t.  J_i qdot = J_i qdot_i for i < k, and the limits.
 *
 * Rotations are bounded by rotation_velocity, or by the robot file if that is less; translations by translation_step in
 * one period. With a posture, zeta |qdot - qdot_p|^2 replaces zeta |qdot|^2 everywhere (postureVelocity()). */
class Nspqp final : public Resolver {
 public:
  explicit Nspqp(const MethodParameters& parameters)
      : Resolver(parameters),
        recovery_(parameters.backend),
        backend_(makeQpBackend(parameters.backend)),
        nearest_(makeQpBackend(parameters.backend)) {}
  Method method() const override { return Method::kNspqp; }
  void reset() noexcept override {
    recovery_.reset();
    backend_->reset();
    nearest_->reset();
  }

 private:
  /// Minimises the error of task `last`, with the tasks before it equal to wanted_.
  void setProblem(const StepProblem& problem, int last, const VelocityBounds& bounds, QuadraticProgram& qp) {
    const int n = problem.joint_count;
    int equalities = 0;
    for (int k = 0; k < last; ++k)
      equalities += static_cast<int>(problem.task[k].velocity.size());
    qp.resize(n, equalities, bounds.row_count);
    addLimits(problem, bounds, qp);
    for (int k = 0, row = 0; k < last; ++k) {
      const int size = static_cast<int>(problem.task[k].velocity.size());
      qp.E.middleRows(row, size) = problem.task[k].jacobian;
      row += size;
    }
    setWanted(last, qp);
    if (last >= 0)
      setSquares(problem.task[last], qp);
    qp.H.diagonal().array() += parameters_.nspqp_zeta;
    if (posture_.size() > 0)
      qp.g -= parameters_.nspqp_zeta * posture_;
  }

  /// e of a problem whose other values stay.
  void setWanted(int last, QuadraticProgram& qp) const {
    for (int k = 0, row = 0; k < last; ++k) {
      const int size = static_cast<int>(wanted_[k].size());
      qp.e.segment(row, size) = wanted_[k];
      row += size;
    }
  }

  /// H = J^T J, of which half is computed, and g = -J^T v.
  static void setSquares(const Task& task, QuadraticProgram& qp) {
    const int rows = static_cast<int>(task.velocity.size());
    for (int j = 0; j < task.jacobian.cols(); ++j) {
      const double* const b = &task.jacobian(0, j);
      double with_velocity = 0.0;
      for (int k = 0; k < rows; ++k)
        with_velocity += b[k] * task.velocity[k];
      qp.g[j] = -with_velocity;
      for (int i = 0; i <= j; ++i) {
        const double* const a = &task.jacobian(0, i);
        double square = 0.0;
        for (int k = 0; k < rows; ++k)
          square += a[k] * b[k];
        qp.H(i, j) = qp.H(j, i) = square;
      }
    }
  }

  /// Replaces the velocities of the tasks before the last by the nearest feasible ones.
  SolveStatus comeNearest(const StepProblem& problem, Solution& solution) noexcept {
    for (int k = 0; k + 1 < problem.task_count; ++k) {
      setProblem(problem, k, solution.bounds, nearest_qp_);
      nearest_->solve(nearest_qp_, qp_solution_);
      solution.iterations += qp_solution_.iterations;
      if (qp_solution_.status != QpStatus::kSolved)
        return statusOf(qp_solution_.status);
      wanted_[k] = problem.task[k].jacobian.lazyProduct(qp_solution_.x);
      solution.velocity = qp_solution_.x;
    }
    return SolveStatus::kSolved;
  }

  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    velocityBounds(problem, parameters_.bounds, parameters_.period, solution.bounds);
    boundSteps(problem, parameters_.translation_step / parameters_.period, parameters_.rotation_velocity,
               solution.bounds);
    posture_.resize(0);
    if (problem.posture.size() > 0)
      posture_ = postureVelocity(problem, parameters_, parameters_.rotation_velocity);
    recovery_.apply(problem, solution.bounds, solution.velocity);
    const int last = problem.task_count - 1;
    for (int k = 0; k < last; ++k)
      wanted_[k] = problem.task[k].velocity;
    setProblem(problem, last, solution.bounds, qp_);
    backend_->solve(qp_, qp_solution_);
    solution.iterations = qp_solution_.iterations;
    const bool infeasible = qp_solution_.status == QpStatus::kInfeasible;
    if (infeasible) {
      explain(problem, solution.bounds, qp_solution_, solution.conflict);
      if (const SolveStatus status = comeNearest(problem, solution); status != SolveStatus::kSolved)
        return status == SolveStatus::kInfeasible ? SolveStatus::kFailed : status;
      setWanted(last, qp_);
      backend_->solve(qp_, qp_solution_);
      solution.iterations += qp_solution_.iterations;
      // solution.velocity satisfies every constraint: an infeasible status then means that no other point does, up to
      // rounding.
      if (qp_solution_.status == QpStatus::kInfeasible)
        return SolveStatus::kInfeasible;
    }
    if (qp_solution_.status != QpStatus::kSolved)
      return statusOf(qp_solution_.status);
    solution.velocity = qp_solution_.x;
    solution.kkt_residual = qp_solution_.residual;
    for (int k = 0; k < problem.task_count; ++k)
      solution.scale[k] = shareOf(problem.task[k], k < last ? wanted_[k] : problem.task[k].velocity);
    return infeasible ? SolveStatus::kInfeasible : SolveStatus::kSolved;
  }

  /// Fraction of a task's velocity that remains in `wanted`, along the task's direction.
  static double shareOf(const Task& task, const TaskVector& wanted) {
    const double size = task.velocity.squaredNorm();
    return size > 0.0 ? std::clamp(wanted.dot(task.velocity) / size, 0.0, 1.0) : 1.0;
  }

  Recovery recovery_;
  std::unique_ptr<QpBackend> backend_, nearest_;
  std::array<TaskVector, kMaxTasks> wanted_;
  RobotVector posture_;  ///< qdot_p; empty: none
  QuadraticProgram qp_, nearest_qp_;
  QpSolution qp_solution_;
};

}  // namespace

std::unique_ptr<Resolver> makeNspqp(const MethodParameters& parameters) { return std::make_unique<Nspqp>(parameters); }

}  // namespace tandem::control
