// SPDX-License-Identifier: Apache-2.0
/** @file Tasks with an activation below one, in every method. */
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "control/parameters.h"
#include "control/resolver.h"
#include "tests/unit/control/step_allocations.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;
using control::Solution;
using control::SolveStatus;

/// Those that do a task whatever follows it, unless it is the last: that one they do as nearly as they can.
constexpr std::array kOrdered{Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp};

/** The two arms, with a row of one joint of arm A at a place in the list. */
struct SoftProblem : ArkProblem {
  bool setRandomWith(Random& random, int place, double activation) {
    if (!setRandom(random, 2e-3))
      return false;
    problem.task_count = 3;
    for (int k = 2; k > place; --k)
      problem.task[static_cast<std::size_t>(k)] = problem.task[static_cast<std::size_t>(k - 1)];
    control::Task& row = problem.task[static_cast<std::size_t>(place)];
    row.jacobian.setZero(1, 12);
    row.jacobian(0, random.integer(0, 2)) = 0.3;
    row.velocity.setConstant(1, 2e-4);
    row.activation = activation;
    return true;
  }
  Solution solved(Method method) const {
    Solution solution;
    control::makeResolver(method, {})->solve(problem, solution);
    EXPECT_EQ(solution.velocity.size(), 12);
    return solution;
  }
  double of(int task, const Solution& solution) const {
    const control::Task& t = problem.task[static_cast<std::size_t>(task)];
    return (t.jacobian * solution.velocity - t.velocity).norm();
  }
};

/// All methods, places of the row, and random problems.
template <class Body>
void forAll(double activation, const Body& body) {
  for (int m = 0; m < control::kMethodCount; ++m) {
    for (int place = 0; place < 3; ++place) {
      SCOPED_TRACE(std::string(control::name(static_cast<Method>(m))) + " row " + std::to_string(place));
      for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
        SCOPED_TRACE(trace(seed));
        Random random(seed);
        SoftProblem soft;
        if (soft.setRandomWith(random, place, activation))
          body(static_cast<Method>(m), place, soft);
      }
    }
  }
}

/// The list without task `place`.
SoftProblem without(const SoftProblem& from, int place) {
  SoftProblem shorter = from;
  for (auto k = static_cast<std::size_t>(place); k < 2; ++k)
    shorter.problem.task[k] = from.problem.task[k + 1];
  shorter.problem.task_count = 2;
  return shorter;
}

TEST(SoftTask, WithoutActivationItIsNotInTheList) {
  forAll(0.0, [](Method method, int place, SoftProblem& soft) {
    const Solution a = soft.solved(method), b = without(soft, place).solved(method);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.velocity, b.velocity);
    EXPECT_EQ(a.scale[static_cast<std::size_t>(place)], 1.0);
    for (int k = 0, from = 0; k < 3; ++k) {
      if (k != place) {
        EXPECT_EQ(a.scale[static_cast<std::size_t>(k)], b.scale[static_cast<std::size_t>(from)]);
        EXPECT_EQ(a.residual[static_cast<std::size_t>(k)], b.residual[static_cast<std::size_t>(from++)]);
      }
    }
  });
}

TEST(SoftTask, IsBlendedInBetweenTheListsWithAndWithoutIt) {
  constexpr double kH = 0.3;
  int changed = 0;
  forAll(kH, [&](Method method, int place, SoftProblem& soft) {
    const Solution blended = soft.solved(method), none = without(soft, place).solved(method);
    soft.problem.task[static_cast<std::size_t>(place)].activation = 1.0;
    const Solution whole = soft.solved(method);
    EXPECT_LT((blended.velocity - (1.0 - kH) * none.velocity - kH * whole.velocity).norm(), 1e-8);
    EXPECT_LT(excess(soft.problem, blended), 1e-9) << "no limit is left";
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(blended.residual[static_cast<std::size_t>(k)], soft.of(k, blended), 1e-15);
    changed += (whole.velocity - none.velocity).norm() > 1e-4 ? 1 : 0;
    if (std::ranges::find(kOrdered, method) == kOrdered.end())
      return;
    for (int k = 0; k < std::min(place, 1); ++k)  // the first of two is not the last of the list without the row
      EXPECT_NEAR(soft.of(k, blended), soft.of(k, whole), 1e-7) << "task " << k << " stands before it";
  });
  EXPECT_GT(changed, 200);
}

/// Nothing jumps while the activation grows from 0 to 1.
TEST(SoftTask, VelocityChangesWithTheActivationContinuously) {
  forAll(0.0, [](Method method, int place, SoftProblem& soft) {
    constexpr int kSteps = 8;
    double& h = soft.problem.task[static_cast<std::size_t>(place)].activation;
    Solution last = soft.solved(method);
    h = 1.0;
    const double whole = (soft.solved(method).velocity - last.velocity).norm();
    for (int i = 1; i <= kSteps; ++i) {
      h = static_cast<double>(i) / kSteps;
      const Solution next = soft.solved(method);
      EXPECT_LE((next.velocity - last.velocity).norm(), (1.0 + 1e-6) * whole / kSteps + 1e-9);
      last = next;
    }
  });
}

TEST(SoftTask, SeveralAreBlendedIndependently) {
  SoftProblem soft;
  for (std::uint32_t seed = 3; seed < 100; ++seed) {
    Random random(seed);
    if (soft.setRandomWith(random, 0, 0.25))
      break;
  }
  ASSERT_EQ(soft.problem.task_count, 3);
  soft.problem.task_count = 4;
  soft.problem.task[3] = soft.problem.task[0];
  soft.problem.task[3].jacobian.setZero();
  soft.problem.task[3].jacobian(0, 4) = 0.05;
  soft.problem.task[3].activation = 0.5;
  const Solution blended = soft.solved(Method::kHqp);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(12);
  for (const double first : {0.0, 1.0}) {
    for (const double last : {0.0, 1.0}) {
      soft.problem.task[0].activation = first;
      soft.problem.task[3].activation = last;
      sum += (first > 0.0 ? 0.25 : 0.75) * 0.5 * soft.solved(Method::kHqp).velocity;
    }
  }
  EXPECT_LT((blended.velocity - sum).norm(), 1e-12);
}

TEST(SoftTask, BadActivationIsRefused) {
  SoftProblem soft;
  for (std::uint32_t seed = 4; seed < 100; ++seed) {
    Random random(seed);
    if (soft.setRandomWith(random, 1, std::nan("")))
      break;
  }
  ASSERT_EQ(soft.problem.task_count, 3);
  const Solution solution = soft.solved(Method::kNspqp);
  EXPECT_EQ(solution.status, SolveStatus::kNotFinite);
  EXPECT_TRUE(solution.velocity.isZero(0.0));
}

}  // namespace
}  // namespace tandem::test
