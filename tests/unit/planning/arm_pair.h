// SPDX-License-Identifier: Apache-2.0
/** @file The two arms of the preset ark2024 for the tests of planning. */
#pragma once

#include <gtest/gtest.h>

#include "kinematics/tube_model.h"
#include "planning/inverse_kinematics.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::test {

using planning::Arms;
using planning::IkAnswer;
using planning::TipTarget;

/** The two arms of the preset ark2024. */
struct Pair {
  std::unique_ptr<kinematics::ArmModel> a, b;
  safety::ArmLimits limits = limitsOf(arkArm(0.0));
  Arms one, both;

  /// @param offset  of each base from the robot's axis, m
  explicit Pair(const char* model, double offset = 0.005)
      : a(kinematics::makeArmModel(model, arkArm(offset))),
        b(kinematics::makeArmModel(model, arkArm(-offset))),
        one{{a.get()}, {&limits}},
        both{{a.get(), b.get()}, {&limits, &limits}} {}

  /// Random joints of all arms inside the limits, with their tips; false if a model has no solution.
  bool known(const Arms& arms, Random& random, safety::RobotVector& q, std::vector<kinematics::Tip>& tips) const {
    q.resize(arms.jointCount());
    tips.resize(arms.models.size());
    for (int k = 0; k < arms.count(); ++k) {
      q.segment(arms.offset(k), arms.size(k)) = randomInside(limits, random);
      kinematics::Tip& tip = tips[static_cast<std::size_t>(k)];
      if (arms.models[static_cast<std::size_t>(k)]->tip(q.segment(arms.offset(k), arms.size(k)), tip) !=
              kinematics::ModelStatus::kOk ||
          tip.conjugate_points > 0)
        return false;
    }
    return true;
  }
};

inline safety::RobotVector home(const Arms& arms) {
  safety::RobotVector q(arms.jointCount());
  for (int k = 0; k < arms.count(); ++k)
    q.segment(arms.offset(k), arms.size(k)) = arkStart(1, k);
  return q;
}

/// All limits are met, and by the model the tips are at their targets.
inline void expectKept(const Arms& arms, const IkAnswer& answer, const std::vector<TipTarget>& targets) {
  for (int k = 0; k < arms.count(); ++k) {
    const auto& limits = *arms.limits[static_cast<std::size_t>(k)];
    EXPECT_LE(safety::largestViolation(limits, answer.q.segment(arms.offset(k), arms.size(k))), 1e-9);
  }
  for (const TipTarget& target : targets) {
    const auto arm = static_cast<std::size_t>(target.arm);
    kinematics::Tip tip;
    kinematics::Branch branch;
    const Eigen::VectorXd q = answer.q.segment(arms.offset(target.arm), arms.size(target.arm));
    ASSERT_EQ(arms.models[arm]->tip(q, branch, tip), kinematics::ModelStatus::kOk);
    EXPECT_LT((tip.pose.translation() - target.position).norm(), 1e-6);
    if (target.direction) {
      EXPECT_LT((tip.pose.linear().col(2) - *target.direction).norm(), 1e-5);
    }
    if (target.orientation) {
      EXPECT_LT(target.orientation->angularDistance(Eigen::Quaterniond(tip.pose.linear())), 1e-5);
    }
  }
}

}  // namespace tandem::test
