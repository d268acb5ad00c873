// SPDX-License-Identifier: Apache-2.0
#include "control/method_check.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <limits>

#include "tests/unit/control/step_allocations.h"

namespace tandem::test {
namespace {

using control::CheckConditions;
using control::CheckResult;
using control::Method;
using control::Solution;
using control::SolveStatus;
using control::StepProblem;

/// A foreign method: solves like a built-in one, then modifies the solution.
class Foreign final : public control::Resolver {
 public:
  using Change = std::function<void(const StepProblem&, Solution&)>;
  explicit Foreign(Method like, Change change = {}, const control::MethodParameters& p = {})
      : Resolver(p), inner_(control::makeResolver(like, p)), change_(std::move(change)) {}
  Method method() const override { return Method::kForeign; }

 private:
  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    inner_->solve(problem, solution);
    if (change_)
      change_(problem, solution);
    return solution.status;
  }
  std::unique_ptr<control::Resolver> inner_;
  Change change_;
};

CheckResult check(control::Resolver& resolver, bool judge_time = false, double period = 0.1) {
  const safety::ArmLimits limits = ArkProblem().limits;
  CheckConditions conditions;
  conditions.parameters.period = period;
  conditions.limits = {&limits, &limits};
  conditions.judge_time = judge_time;
  if (canCountAllocations())
    conditions.allocation_count = allocationCount;
  return checkMethod(resolver, conditions);
}

std::string refusalOf(Foreign::Change change) {
  Foreign method(Method::kHqp, std::move(change));
  return check(method).refusal;
}

TEST(MethodCheck, TakesTheBuiltInMethodsButTheOneThatDoesTheFirstTaskTwice) {
  for (int m = 0; m < control::kMethodCount; ++m) {
    Foreign method(static_cast<Method>(m));
    const CheckResult result = check(method);
    SCOPED_TRACE(std::string(control::name(static_cast<Method>(m))) + ": " + result.refusal + result.remarks);
    EXPECT_EQ(result.refusal.empty(), static_cast<Method>(m) != Method::kNspwln);
    const bool bounded = m >= static_cast<int>(Method::kNspqp);
    if (result.refusal.empty()) {
      EXPECT_EQ(result.remarks.find("leaves the limits to the gate") == std::string::npos, bounded);
    }
  }
}

TEST(MethodCheck, RefusesABuiltInMethodUnderAnotherName) {
  const auto hqp = control::makeResolver(Method::kHqp, {});
  EXPECT_NE(check(*hqp).refusal.find("found method() = hqp"), std::string::npos);
}

TEST(MethodCheck, RefusesAnswersThatAreNotFiniteOrOfAnotherSize) {
  const char* expected = "expected a finite velocity of every joint";
  EXPECT_NE(refusalOf([](const StepProblem&, Solution& s) {
              s.velocity[3] = std::numeric_limits<double>::quiet_NaN();
            }).find(expected),
            std::string::npos);
  EXPECT_NE(refusalOf([](const StepProblem& p, Solution& s) { s.velocity.setZero(p.joint_count - 1); }).find(expected),
            std::string::npos);
  EXPECT_NE(refusalOf([](const StepProblem&, Solution& s) { s.status = SolveStatus::kIterationLimit; }).find(expected),
            std::string::npos);
}

TEST(MethodCheck, RefusesWhatDoesNotFollowFromTheJacobian) {
  EXPECT_NE(refusalOf([](const StepProblem&, Solution& s) { s.velocity.setConstant(1e-5); }).find("from the Jacobian"),
            std::string::npos);
  // It does not move and reports scale 0, which is consistent but not a method.
  EXPECT_NE(refusalOf([](const StepProblem&, Solution& s) {
              s.velocity.setZero();
              s.scale.fill(0.0);
            }).find("from the Jacobian"),
            std::string::npos);
}

TEST(MethodCheck, RequiresTheScaleOfAnUnsolvedTaskToBeZero) {
  control::MethodParameters parameters;
  const auto first_alone = [&parameters](double scale) {
    return [scale, inner = std::shared_ptr(control::makeResolver(Method::kHqp, parameters))](const StepProblem& p,
                                                                                             Solution& s) {
      StepProblem one = p;
      one.task_count = 1;
      inner->solve(one, s);
      s.scale[1] = scale;
    };
  };
  EXPECT_NE(refusalOf(first_alone(1.0)).find("of task 2 is done where Solution::scale says 100 %"), std::string::npos);
  Foreign honest(Method::kHqp, first_alone(0.0));
  const CheckResult result = check(honest);
  EXPECT_EQ(result.refusal, "");
  EXPECT_NE(result.remarks.find("neglects tasks after the first"), std::string::npos);
}

TEST(MethodCheck, RefusesVelocitiesBeyondTheBoundsThatTheMethodClaimsToKeep) {
  const auto faster = [](const StepProblem& p, Solution& s) {
    if (p.joint[0].velocity < 1.0)  // near limits alone
      s.velocity *= 3.0;
  };
  EXPECT_NE(refusalOf(faster).find("beyond the bounds"), std::string::npos);
  EXPECT_EQ(refusalOf([&faster](const StepProblem& p, Solution& s) {
              faster(p, s);
              s.bounds.lower.setConstant(-safety::kUnlimited);
              s.bounds.upper.setConstant(safety::kUnlimited);
              s.bounds.row_count = 0;
            }),
            "");
}

TEST(MethodCheck, RefusesAllocations) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  const std::string refusal = refusalOf([](const StepProblem& p, Solution& s) {
    const Eigen::VectorXd copy = s.velocity.head(p.joint_count);
    s.velocity = copy;
  });
  EXPECT_NE(refusal.find("allocations in"), std::string::npos) << refusal;
}

TEST(MethodCheck, JudgesTimeAgainstHalfThePeriod) {
  const auto slow = [](const StepProblem&, Solution&) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(300);
    while (std::chrono::steady_clock::now() < end) {
    }
  };
  Foreign method(Method::kNsp, slow);
  EXPECT_NE(check(method, true, 3e-4).refusal.find("expected at most 0.15 ms"), std::string::npos);
  EXPECT_EQ(check(method, true, 1.0).refusal, "");
  EXPECT_EQ(check(method).refusal, "");
}

}  // namespace
}  // namespace tandem::test
