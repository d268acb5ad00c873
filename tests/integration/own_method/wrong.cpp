// SPDX-License-Identifier: Apache-2.0
// Invalid libraries: one for each value of WRONG.
#include <chrono>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "control/foreign_method.h"

using namespace tandem::control;

namespace {

enum Wrong { kThrows, kNotFinite, kAllocates, kSlow, kIgnoresJacobian, kCrashes, kOtherLayout, kBeyondBounds };

/// J^T (J J^T)^-1 v of the first task for three rows: a correct method.
class WrongMethod final : public Resolver {
 public:
  explicit WrongMethod(const MethodParameters& parameters) : Resolver(parameters) {}
  Method method() const override { return Method::kForeign; }

 private:
  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    const TaskJacobian& J = problem.task[0].jacobian;
    const Eigen::Matrix3d gram = J.lazyProduct(J.transpose()) + 1e-12 * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d y = inverse(gram) * problem.task[0].velocity;
    solution.velocity = J.transpose().lazyProduct(y);
    solution.scale[0] = 1.0;
    spoil(problem, solution);
    return SolveStatus::kSolved;
  }

  static Eigen::Matrix3d inverse(const Eigen::Matrix3d& A) {
    Eigen::Matrix3d adjugate;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
        adjugate(i, j) = A(a, c) * A(b, d) - A(a, d) * A(b, c);
      }
    }
    return adjugate / A.row(0).dot(adjugate.col(0));
  }

  void spoil(const StepProblem& problem, Solution& solution) {
    using Clock = std::chrono::steady_clock;
    switch (WRONG) {
      case kThrows:
        throw std::runtime_error("no inverse");
      case kNotFinite:
        solution.velocity[0] = std::numeric_limits<double>::quiet_NaN();
        break;
      case kAllocates:
        kept_ = std::make_unique<double[]>(4);
        break;
      case kSlow:
        for (const auto end = Clock::now() + std::chrono::milliseconds(8); Clock::now() < end;) {
        }
        break;
      case kIgnoresJacobian:
        solution.velocity.setConstant(problem.task[0].velocity[0]);
        break;
      case kCrashes:
        std::abort();
      case kBeyondBounds:
        solution.bounds.lower.setConstant(-1.0);
        break;
      default:
        break;
    }
  }

  std::unique_ptr<double[]> kept_;
};

}  // namespace

#if WRONG == 6
constexpr MethodAbi otherLayout() {
  MethodAbi abi = methodAbi();
  abi.layout = 1;
  return abi;
}
extern "C" constinit const ForeignMethod tandem_method = {otherLayout(), "wrong", nullptr};
#else
TANDEM_METHOD("wrong", WrongMethod);
#endif
