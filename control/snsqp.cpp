// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "control/detail/qp_methods.h"
#include "control/methods.h"
#include "control/posture.h"
#include "control/recovery.h"

namespace tandem::control {
namespace {

/** Saturation in the null space as a sequence of QPs, Alsaka et al. 2024, (8). For k = 1, 2, ..., with qdot_0 = 0:
 *
 *   min over qdot, s_k   1/2 qdot^T (zeta I) qdot + 1/zeta (1 - s_k)^2
 *   s.t.   J_k qdot = J_k qdot_{k-1} + s_k (v_k - J_k qdot_{k-1}),
 *          J_i qdot = J_i qdot_{k-1}  for all i < k,   0 <= s_k <= 1,
 *          lower <= qdot <= upper,   a_i^T qdot <= rate_i  (coupled rows; none with frozen bounds).
 *
 * At k = 1 the first line is J_1 qdot = s_1 v_1, as printed. For k > 1 the printed J_k qdot = s_k v_k is often
 * infeasible under limits, whereas here s_k = 0 is always feasible: qdot_{k-1} is a feasible point of level k. qdot_0
 * is zero inside all limits, else the return velocity (Recovery). With zeta -> 0, s_k is the largest that the limits
 * allow, and qdot the least velocity for it; at zeta = 1e-5 s_k is that of the linear program to 1e-9. Rotations are
 * bounded by snsqp_rotation_velocity: without a bound the optimum spends any number of turns on the last per mille of
 * s; translations by translation_step in one period.
 *
 * With a posture, qdot_0 is the velocity within the limits nearest to qdot_p, and zeta |qdot - qdot_0|^2 replaces zeta
 * |qdot|^2: motion that the tasks do not use because of limits, s_k < 1, goes to the posture. */
class Snsqp final : public Resolver {
 public:
  explicit Snsqp(const MethodParameters& parameters)
      : Resolver(parameters), recovery_(parameters.backend), posture_(parameters.backend) {
    for (auto& backend : backend_)
      backend = makeQpBackend(parameters.backend);
  }
  Method method() const override { return Method::kSnsqp; }
  void reset() noexcept override {
    recovery_.reset();
    for (auto& backend : backend_)
      backend->reset();
    posture_.reset();
  }

 private:
  /// Sets level k over the variables [qdot, s_k].
  void setLevel(const StepProblem& problem, int k, const Solution& solution) {
    const int n = problem.joint_count;
    const double zeta = parameters_.snsqp_zeta;
    int equalities = 0;
    for (int i = 0; i <= k; ++i)
      equalities += static_cast<int>(problem.task[i].velocity.size());
    qp_.resize(n + 1, equalities, solution.bounds.row_count);
    addLimits(problem, solution.bounds, qp_);
    qp_.H.diagonal().head(n).setConstant(zeta);
    if (problem.posture.size() > 0)
      qp_.g.head(n) = -zeta * base_;
    qp_.H(n, n) = 2.0 / zeta;
    qp_.g[n] = -2.0 / zeta;
    qp_.lower[n] = 0.0;
    qp_.upper[n] = 1.0;
    for (int i = 0, row = 0; i <= k; ++i) {
      const Task& task = problem.task[i];
      const int size = static_cast<int>(task.velocity.size());
      const TaskVector done = task.jacobian.lazyProduct(solution.velocity);
      qp_.E.block(row, 0, size, n) = task.jacobian;
      qp_.e.segment(row, size) = done;
      if (i == k)
        qp_.E.block(row, n, size, 1) = done - task.velocity;
      row += size;
    }
  }

  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    velocityBounds(problem, parameters_.bounds, parameters_.period, solution.bounds);
    const double rotation = std::min(parameters_.rotation_velocity, parameters_.snsqp_rotation_velocity);
    boundSteps(problem, parameters_.translation_step / parameters_.period, rotation, solution.bounds);
    recovery_.apply(problem, solution.bounds, solution.velocity);
    if (problem.posture.size() > 0) {
      posture_.apply(problem, postureVelocity(problem, parameters_, rotation), solution.bounds, solution.velocity);
      base_ = solution.velocity;
    }
    for (int k = 0; k < problem.task_count; ++k) {
      setLevel(problem, k, solution);
      backend_[k]->solve(qp_, qp_solution_);
      solution.iterations += qp_solution_.iterations;
      if (k > 0 && qp_solution_.status == QpStatus::kInfeasible) {
        // qdot_{k-1} with s_k = 0 satisfies every constraint of this level, so it is the only feasible point, up to
        // rounding.
        solution.scale[k] = 0.0;
        continue;
      }
      if (qp_solution_.status != QpStatus::kSolved)
        return statusOf(qp_solution_.status);
      solution.kkt_residual = std::max(solution.kkt_residual, qp_solution_.residual);
      solution.velocity = qp_solution_.x.head(problem.joint_count);
      solution.scale[k] = qp_solution_.x[problem.joint_count];
    }
    return SolveStatus::kSolved;
  }

  Recovery recovery_;
  PostureWithinLimits posture_;
  RobotVector base_;                                           ///< qdot_0 with a posture
  std::array<std::unique_ptr<QpBackend>, kMaxTasks> backend_;  ///< one per level, each with its own warm start
  QuadraticProgram qp_;
  QpSolution qp_solution_;
};

}  // namespace

std::unique_ptr<Resolver> makeSnsqp(const MethodParameters& parameters) { return std::make_unique<Snsqp>(parameters); }

}  // namespace tandem::control
