// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>

#include "control/damping.h"
#include "control/limit_weights.h"
#include "control/methods.h"
#include "control/posture.h"

namespace tandem::control {
namespace {

/** Weighted least norm over all joints at once: the corrected form of Alsaka et al. 2024, (6), for tasks 1, 2, ...
 *
 *   qdot_0 = 0,  N_0 = I,
 *   qdot_k = qdot_{k-1} + (J_k N_{k-1})# (v_k - J_k qdot_{k-1}),
 *   A# = W^-1 A^T (A W^-1 A^T + I / w_track)^-1,
 *   N_k = N_{k-1} - (J_k N_{k-1})# J_k N_{k-1}.
 *
 * With two tasks: qdot = J_1# v_1 + N (J_2 N)# (v_2 - J_2 J_1# v_1). One weighted inverse over the columns of all arms
 * does each task once, and the second task accounts for its motion by the first. W: limitWeights() with kCorrected. */
class NspwlnJoint final : public Resolver {
 public:
  explicit NspwlnJoint(const MethodParameters& parameters) : Resolver(parameters) {}
  Method method() const override { return Method::kNspwlnJoint; }

 private:
  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    const RobotVector weights = limitWeights(problem, parameters_, kCorrected);
    const int n = problem.joint_count;
    projector_.setIdentity(n, n);
    for (int k = 0; k < problem.task_count; ++k) {
      const Task& task = problem.task[k];
      const int rows = static_cast<int>(task.velocity.size());
      TaskJacobian projected = task.jacobian.lazyProduct(projector_);
      TaskJacobian weighted = projected;
      for (int j = 0; j < n; ++j)
        weighted.col(j) /= weights[j];
      TaskGram gram = weighted.lazyProduct(projected.transpose());
      dampSingularDirections(plainGram(problem, parameters_, 0, projected), singularThreshold(parameters_), gram);
      gram.diagonal().array() += 1.0 / parameters_.track_weight;
      const TaskVector wanted = task.velocity - task.jacobian.lazyProduct(solution.velocity);
      const auto factor = gram.llt();
      const TaskVector y = factor.solve(wanted);
      solution.velocity += weighted.transpose().lazyProduct(y);
      solution.scale[k] = 1.0;
      if (k + 1 == problem.task_count)
        break;
      TaskJacobian pushed(rows, n);
      for (int j = 0; j < n; ++j) {
        const TaskVector column = projected.col(j);
        pushed.col(j) = factor.solve(column);
      }
      projector_ -= weighted.transpose().lazyProduct(pushed);
    }
    addPosture(problem, parameters_, weights, 1.0 / parameters_.track_weight, solution.velocity);
    return SolveStatus::kSolved;
  }

  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, safety::kMaxJoints, safety::kMaxJoints>
      projector_;
};

}  // namespace

std::unique_ptr<Resolver> makeNspwlnJoint(const MethodParameters& parameters) {
  return std::make_unique<NspwlnJoint>(parameters);
}

}  // namespace tandem::control
