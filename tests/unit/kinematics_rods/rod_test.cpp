// SPDX-License-Identifier: Apache-2.0
/** @file Cosserat rod under random loads: derivatives, energy, reciprocity, convergence, comparison with an
 * independent solver. */
#include <gtest/gtest.h>

#include "kinematics/gauss_legendre.h"
#include "kinematics/rotations.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/kinematics_rods/tendon_oracle.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using Eigen::Vector3d;
using kinematics::ModelStatus;
using kinematics::cosserat::Actuator;
using kinematics::cosserat::Matrix6;
using kinematics::cosserat::Rod;
using kinematics::cosserat::RodAnswer;
using kinematics::cosserat::RodBranch;
using kinematics::cosserat::RodInput;
using kinematics::cosserat::RodModel;
using kinematics::cosserat::RodPoint;

/// An input and its solution, from a cold start.
struct Case {
  explicit Case(std::uint32_t seed, double strength = 1.0)
      : random(seed), model(anyRod(random)), input(anyInput(model.rod(), random, strength)) {
    status = model.solve(input, branch, answer);
  }
  /// Change of the pose for another input, on the same branch.
  Eigen::VectorXd moved(const RodInput& other) const {
    RodBranch there = branch;
    RodAnswer found;
    if (model.solve(other, there, found) != ModelStatus::kOk)
      return {};
    return poseDifference(answer.tip, found.tip);
  }
  Random random;
  RodModel model;
  RodInput input;
  RodBranch branch;
  RodAnswer answer;
  ModelStatus status;
};

TEST(Rod, DerivativesAreThoseOfTheSolution) {
  int compared = 0, vague = 0;
  double worst = 0.0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(30); ++seed) {
    SCOPED_TRACE(trace(seed));
    const Case at(seed);
    if (at.status != ModelStatus::kOk || at.answer.conjugate_points > 0)
      continue;
    const double length = kinematics::cosserat::lengthOf(at.model.rod(), at.input);
    const double moment = kinematics::cosserat::momentScale(at.model.rod(), at.input);
    const auto compare = [&](const char* what, const Eigen::VectorXd& column, double unit, const auto& change) {
      const Difference difference = differentiate(
          [&](double h) {
            RodInput there = at.input;
            change(there, h * unit);
            return at.moved(there);
          },
          0.02);
      const Eigen::VectorXd expected = difference.value.size() ? Eigen::VectorXd(difference.value / unit) : column;
      const double size = std::max(1e-3 / unit, expected.norm());
      if (!(difference.error / unit < 3e-7 * size)) {
        ++vague;
        return;
      }
      ++compared;
      worst = std::max(worst, (expected - column).norm() / size);
      EXPECT_LT((expected - column).norm(), 1e-6 * size) << what;
    };
    for (int j = 0; j < 3; ++j) {
      compare("force", at.answer.compliance.col(j), moment / length,
              [j](RodInput& input, double h) { input.tip[j] += h; });
      compare("moment", at.answer.compliance.col(3 + j), moment,
              [j](RodInput& input, double h) { input.tip[3 + j] += h; });
      compare("base shift", at.answer.by_base.col(j), length,
              [j](RodInput& input, double h) { input.base.translation()[j] += h; });
      compare("base turn", at.answer.by_base.col(3 + j), 1.0, [j](RodInput& input, double h) {
        input.base.linear() = Eigen::AngleAxisd(h, Vector3d::Unit(j)) * input.base.linear();
      });
    }
    compare("length", at.answer.by_length, at.input.first_length,
            [](RodInput& input, double h) { input.first_length += h; });
    for (std::size_t j = 0; j < at.model.rod().actuators.size(); ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      const bool tendon = at.model.rod().actuators[j].kind == Actuator::kTendon;
      if (!tendon || at.input.inputs[i] > 0.03 * moment / 1e-3)
        compare("input", at.answer.by_input.col(i), tendon ? moment / 1e-3 : 1.0,
                [i](RodInput& input, double h) { input.inputs[i] += h; });
    }
  }
  std::printf("compared %d, vague %d, worst %.1e\n", compared, vague, worst);
  EXPECT_GT(compared, 300);
  EXPECT_LT(vague, compared / 20);
}

/// Maxwell and Betti: C is symmetric without a moment; a moment of constant direction adds W' [M]x W.
TEST(Rod, ComplianceIsReciprocal) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const RodModel model(anyRod(random));
    RodInput input = anyInput(model.rod(), random, 1.0);
    for (auto& density : input.moment)
      density.setZero();
    if (random.chance(0.5))
      input.tip.tail<3>().setZero();
    RodBranch branch;
    RodAnswer answer;
    if (model.solve(input, branch, answer) != ModelStatus::kOk)
      continue;
    const Matrix6& c = answer.compliance;
    const Matrix6 skewed = c.bottomRows<3>().transpose() * kinematics::skew(input.tip.tail<3>()) * c.bottomRows<3>();
    EXPECT_LT((c - c.transpose() - skewed).norm(), 1e-7 * c.norm());
  }
}

TEST(Rod, EnergyIsTheWorkOfTheLoad) {
  const auto& rule = kinematics::GaussLegendre::rule(14);
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rod rod = anyRod(random);
    rod.actuators.clear();
    const RodModel model(rod);
    RodInput full(rod);
    full.base = anyPose(random);
    full.tip = anyInput(rod, random, 0.7).tip;
    double work = 0.0;
    RodBranch branch;
    RodAnswer answer;
    for (int k = 0; k < rule.count; ++k) {  // d x = C W d lambda
      RodInput input = full;
      input.tip *= rule.node[static_cast<std::size_t>(k)];
      ASSERT_EQ(model.solve(input, branch, answer), ModelStatus::kOk);
      work += rule.weight[static_cast<std::size_t>(k)] * rule.node[static_cast<std::size_t>(k)] *
              full.tip.dot(answer.compliance * full.tip);
    }
    ASSERT_EQ(model.solve(full, branch, answer), ModelStatus::kOk);
    EXPECT_GT(answer.energy, 0.0);
    EXPECT_NEAR(work, answer.energy, 1e-6 * answer.energy);
  }
}

/// The same equilibrium in strains instead of moments, with the tendons as loads: Rucker and Webster 2011.
TEST(Rod, AgreesWithTendonsAsDistributedLoads) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Case at(seed);
    if (at.status != ModelStatus::kOk)
      continue;
    std::vector<RodPoint> shape;
    ASSERT_EQ(at.model.shape(at.input, at.branch, 41, shape), ModelStatus::kOk);
    const TendonOracle oracle(at.model.rod(), at.input, shape.front());
    const double length = kinematics::cosserat::lengthOf(at.model.rod(), at.input);
    EXPECT_LT((oracle.pose.translation() - shape.back().pose.translation()).norm(), 1e-8 * length);
    EXPECT_LT((oracle.pose.linear() - shape.back().pose.linear()).norm(), 1e-7);
    const double moment = kinematics::cosserat::momentScale(at.model.rod(), at.input);
    EXPECT_LT(oracle.left_force.norm(), 1e-6 * moment / length);
    EXPECT_LT(oracle.left_moment.norm(), 1e-6 * moment);
    EXPECT_LT((shape.back().pose * at.model.rod().tool * at.answer.tip.inverse()).translation().norm(), 1e-9);
    ++compared;
  }
  EXPECT_GT(compared, 40);
}

TEST(Rod, ConvergesWithTheOrderOfItsMethod) {
  std::vector<double> orders;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(20); ++seed) {
    SCOPED_TRACE(trace(seed));
    const Case at(seed, 2.0);
    if (at.status != ModelStatus::kOk)
      continue;
    const auto end_of = [&](int steps) {
      RodBranch branch = at.branch;
      std::vector<RodPoint> ends;
      EXPECT_EQ(RodModel(at.model.rod(), {.fixed_steps = steps}).shape(at.input, branch, 2, ends), ModelStatus::kOk);
      return ends.back().pose;
    };
    const Eigen::Isometry3d reference = end_of(64);
    double coarse = poseDifference(reference, end_of(2)).norm();
    for (int steps = 4; steps <= 16; steps *= 2) {
      const double fine = poseDifference(reference, end_of(steps)).norm();
      if (coarse < 1e-4 && fine > 1e-12)  // neither too coarse for an order nor within rounding errors
        orders.push_back(std::log2(coarse / fine));
      coarse = fine;
    }
  }
  ASSERT_GT(orders.size(), 10u);
  std::sort(orders.begin(), orders.end());
  std::printf("order: median %.1f of %zu, least %.1f\n", orders[orders.size() / 2], orders.size(), orders.front());
  EXPECT_GT(orders[orders.size() / 2], 7.0);
  EXPECT_LT(orders[orders.size() / 2], 10.0);
}

TEST(Rod, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "the sanitizer's allocator is not counted";
  Case at(baseSeed() + 3);
  const std::size_t before = allocationCount();
  for (int k = 0; k < 20; ++k) {
    at.input.tip[0] += 1e-4;
    ASSERT_EQ(at.model.solve(at.input, at.branch, at.answer), ModelStatus::kOk);
  }
  EXPECT_EQ(allocationCount(), before);
}

TEST(Rod, RefusesInvalidInput) {
  Random random(baseSeed());
  Rod rod;
  rod.sections = {kinematics::cosserat::tubeSection(0.1, 2e-3, 1e-3, 1e9, 0.4)};
  rod.actuators = {{Actuator::kTendon, 0, Vector3d(1e-3, 0.0, 0.0)}};
  const RodModel model(rod);
  RodBranch branch;
  RodAnswer answer;
  RodInput input(rod);
  input.inputs[0] = -1.0;
  EXPECT_EQ(model.solve(input, branch, answer), ModelStatus::kTendonPushes);
  input.inputs[0] = 1.0;
  input.first_length = -0.01;
  EXPECT_EQ(model.solve(input, branch, answer), ModelStatus::kDistalInside);
  input.first_length = 0.0;
  EXPECT_EQ(model.solve(input, branch, answer), ModelStatus::kNotExtended);
  input.first_length = 0.1;
  input.tip[2] = std::nan("");
  EXPECT_EQ(model.solve(input, branch, answer), ModelStatus::kNotFinite);
  input.tip[2] = 1e9;
  input.tip[0] = -1e9;
  EXPECT_EQ(model.solve(input, branch, answer), ModelStatus::kNotConverged);
  EXPECT_FALSE(branch.known);

  const auto refused = [](Rod bad, auto change, const std::string& what) {
    change(bad);
    try {
      const RodModel accepted{bad};
      ADD_FAILURE() << "accepted: " << what;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  refused(
      rod, [](Rod& bad) { bad.sections.clear(); }, "sections");
  refused(
      rod, [](Rod& bad) { bad.sections[0].moment_stiffness.z() = 0.0; }, "section 1, moment stiffness");
  refused(
      rod, [](Rod& bad) { bad.sections[0].force_stiffness.x() = -1.0; }, "section 1, force stiffness");
  refused(
      rod, [](Rod& bad) { bad.sections[0].length = 0.0; }, "length");
  refused(
      rod, [](Rod& bad) { bad.actuators[0].section = 1; }, "actuator 1, section");
  refused(
      rod, [](Rod& bad) { bad.actuators[0].vector.z() = 1e-3; }, "z = 0");
  refused(
      rod, [](Rod& bad) { bad.actuators.resize(5); }, "at most 4");
}

}  // namespace
}  // namespace tandem::test
