// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>

#include "control/limit_weights.h"
#include "control/methods.h"
#include "control/posture.h"

namespace tandem::control {
namespace {

/** Null-space projection with weighted least norm, Alsaka et al. 2024, (6), as printed:
 *
 *   qdot = inv(J_1) v_1 + (I - inv(J_1) J_1) inv(J_2) v_2,
 *   inv(J) stacks, arm by arm,  (J_k^T W_track J_k + W_act,k)^-1 J_k^T W_track,
 *
 * where J_k are the columns of arm k and W_act the weights of limitWeights(). Each arm minimises (4) separately, so
 * each of the two arms does the whole primary task: J_1 inv(J_1) is about 2 I.
 *
 * inv is computed as W^-1 J^T (J W^-1 J^T + I / w_track)^-1, the same matrix by the push-through identity, which stays
 * accurate with W_track 1e8 times W_act. */
class Nspwln final : public Resolver {
 public:
  explicit Nspwln(const MethodParameters& parameters) : Resolver(parameters) {}
  Method method() const override { return Method::kNspwln; }

 private:
  RobotVector inverse(const StepProblem& problem,
                      const RobotVector& weights,
                      const TaskJacobian& J,
                      const TaskVector& r) const {
    RobotVector qdot(problem.joint_count);
    for (int arm = 0; arm < problem.arm_count; ++arm) {
      const int begin = problem.arm_offset[arm], size = problem.arm_offset[arm + 1] - begin;
      TaskJacobian Jk = J.middleCols(begin, size);
      TaskJacobian weighted = Jk;
      for (int j = 0; j < size; ++j)
        weighted.col(j) /= weights[begin + j];
      TaskGram gram = weighted.lazyProduct(Jk.transpose());
      gram.diagonal().array() += 1.0 / parameters_.track_weight;
      const TaskVector y = gram.llt().solve(r);
      qdot.segment(begin, size) = weighted.transpose().lazyProduct(y);
    }
    return qdot;
  }

  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    const RobotVector weights = limitWeights(problem, parameters_, kAsPrinted);
    for (int k = 0; k < problem.task_count; ++k) {
      RobotVector add = inverse(problem, weights, problem.task[k].jacobian, problem.task[k].velocity);
      if (k > 0) {
        const TaskJacobian& first = problem.task[0].jacobian;
        const TaskVector moved = first.lazyProduct(add);
        add -= inverse(problem, weights, first, moved);
      }
      solution.velocity += add;
      solution.scale[k] = 1.0;
    }
    addPosture(problem, parameters_, weights, 1.0 / parameters_.track_weight, solution.velocity);
    return SolveStatus::kSolved;
  }
};

}  // namespace

std::unique_ptr<Resolver> makeNspwln(const MethodParameters& parameters) {
  return std::make_unique<Nspwln>(parameters);
}

}  // namespace tandem::control
