// SPDX-License-Identifier: Apache-2.0
/** @file Arms and joints that the tests of the compliant model run over. */
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "kinematics/compliant_model.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::test {

/// The laboratory's published robot: Boyer et al., RA-L 2024, doi 10.1109/LRA.2024.3455906.
inline kinematics::ConcentricTubeArm timcArm() {
  kinematics::ConcentricTubeArm arm;
  arm.tubes = {{1.524e-3, 1.3e-3, 58e9, 0.3, {}}, {1.8e-3, 1.62e-3, 58e9, 0.3, {}}, {2.35e-3, 2.06e-3, 58e9, 0.3, {}}};
  constexpr double kLength[] = {0.463, 0.3305, 0.199}, kCurvature[] = {10.0, 5.0, 7.0};
  for (int i = 0; i < 3; ++i) {
    arm.tubes[i].addSection(kLength[i] - 0.05, 0.0);
    arm.tubes[i].addSection(0.05, kCurvature[i]);
  }
  return arm;
}

/// The same arm with tubes curved over their last 50 to 150 mm, so that many joint vectors have several equilibria.
inline kinematics::ConcentricTubeArm longCurved(kinematics::ConcentricTubeArm arm, const std::vector<double>& curved) {
  for (int i = 0; i < arm.tubeCount(); ++i) {
    const double length = arm.tubes[i].length(), curvature = arm.tubes[i].sections.back().curvature;
    arm.tubes[i].sections.clear();
    arm.tubes[i].addSection(length - curved[i], 0.0);
    arm.tubes[i].addSection(curved[i], curvature);
  }
  return arm;
}

struct NamedArm {
  std::string name;
  kinematics::ConcentricTubeArm arm;
};

/// The published geometries, and variants with several equilibria.
inline std::vector<NamedArm> namedArms() {
  return {{"ark2024", arkArm(0.005)},
          {"timc2024", timcArm()},
          {"ark2024 long", longCurved(arkArm(0.005), {0.15, 0.12, 0.08})},
          {"timc2024 long", longCurved(timcArm(), {0.1, 0.15, 0.05})}};
}

/// Arc lengths where a property of tubes 1..`tubes` changes, m.
inline std::vector<double> places(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, int tubes) {
  std::vector<double> result{0.0};
  for (int i = 0; i < tubes; ++i) {
    double s = q[i];
    for (const auto& section : arm.tubes[i].sections)
      result.push_back(s += section.length);
  }
  return result;
}

/// Random joints for which a model has a solution: with probability `hard` for each tube, one of its boundaries meets
/// one of another tube or the entry point, exactly or within a micrometre, or its motor is at the entry point.
inline Eigen::VectorXd jointsAnywhere(const kinematics::ConcentricTubeArm& arm, Random& random, double hard = 0.4) {
  const int n = arm.tubeCount();
  Eigen::VectorXd q(2 * n);
  double inner_end = arm.tubes[0].length();
  for (int i = 0; i < n; ++i) {
    const double length = arm.tubes[i].length(), shortest = i == 0 ? 0.02 : -0.03;
    double end = random.uniform(shortest, std::max(shortest, std::min(length, inner_end)));
    if (random.chance(hard)) {
      const auto known = places(arm, q, i);
      const auto own = places(arm, Eigen::VectorXd::Constant(2 * n, -length), i + 1);  // of tube i, from its end
      const int sections = static_cast<int>(arm.tubes[i].sections.size());
      constexpr double kGap[] = {0.0, 0.0, 1e-6, -1e-6, 1e-7, -1e-8, 1e-10, -1e-12};
      const double target = known[random.integer(0, static_cast<int>(known.size()) - 1)] + kGap[random.integer(0, 7)];
      const double boundary = own[own.size() - 1 - random.integer(0, sections - 1)];
      end = random.chance(0.2) ? length : target - boundary;
    }
    end = std::min({std::max(end, shortest), length, inner_end});  // so that straight paths stay inside, too
    q[i] = std::min(0.0, end - length);
    inner_end = q[i] + length;
    q[n + i] = random.uniform(-std::numbers::pi, std::numbers::pi);
  }
  return q;
}

/// Largest angle between a tube's end and its motor due to torsion, rad.
inline double twist(const kinematics::Branch& branch, const Eigen::VectorXd& q) {
  const Eigen::Index n = q.size() / 2;
  return (branch.end_angle.head(n) - q.tail(n)).cwiseAbs().maxCoeff();
}

/// Angle between two orientations, rad.
inline double turned(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  const Eigen::Matrix3d turn = a.transpose() * b;
  const Eigen::Vector3d axis(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  return std::atan2(axis.norm(), turn.trace() - 1.0);
}

}  // namespace tandem::test
