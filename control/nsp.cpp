// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>

#include "control/damping.h"
#include "control/methods.h"
#include "control/posture.h"

namespace tandem::control {
namespace {

/** Null-space projection, Alsaka et al. 2024, (3), with damped pseudoinverses:
 *
 *   qdot = J_1# v_1 + (I - J_1# J_1) J_2# v_2,   J# = J^T (J J^T + d^2 I)^-1.
 *
 * Without limits: the starting point of the paper. Further tasks are projected into the null space of the first in the
 * same way. */
class Nsp final : public Resolver {
 public:
  explicit Nsp(const MethodParameters& parameters) : Resolver(parameters) {}
  Method method() const override { return Method::kNsp; }

 private:
  /// J# r.
  RobotVector dampedInverse(const TaskJacobian& J, const TaskVector& r) const {
    TaskGram gram = J.lazyProduct(J.transpose());
    dampSingularDirections(TaskGram(gram), parameters_.singular_lever, gram);
    gram.diagonal().array() += parameters_.nsp_damping * parameters_.nsp_damping;
    const TaskVector y = gram.llt().solve(r);
    return J.transpose().lazyProduct(y);
  }

  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    for (int k = 0; k < problem.task_count; ++k) {
      RobotVector add = dampedInverse(problem.task[k].jacobian, problem.task[k].velocity);
      if (k > 0) {
        const TaskJacobian& first = problem.task[0].jacobian;
        const TaskVector moved = first.lazyProduct(add);
        add -= dampedInverse(first, moved);
      }
      solution.velocity += add;
      solution.scale[k] = 1.0;
    }
    addPosture(problem, parameters_, RobotVector::Ones(problem.joint_count),
               parameters_.nsp_damping * parameters_.nsp_damping, solution.velocity);
    return SolveStatus::kSolved;
  }
};

}  // namespace

std::unique_ptr<Resolver> makeNsp(const MethodParameters& parameters) { return std::make_unique<Nsp>(parameters); }

}  // namespace tandem::control
