// SPDX-License-Identifier: Apache-2.0
/** @file Random concentric tube arms with matching limits. */
#pragma once

#include <numbers>

#include "kinematics/concentric_tube.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::test {

/// One to four sections of random curvature; sometimes a softer one, like a notched tube.
inline void addRandomSections(kinematics::Tube& tube, double length, Random& random) {
  const int sections = random.integer(1, 4);
  for (int k = 0; k < sections; ++k) {
    const double part = k + 1 == sections ? length : random.uniform(0.1, 0.6) * length;
    tube.addSection(part, random.chance(0.3) ? 0.0 : random.uniform(-15.0, 15.0));
    if (random.chance(0.2)) {
      tube.sections.back().bending_stiffness *= random.uniform(0.2, 1.0);
      tube.sections.back().torsional_stiffness *= random.uniform(0.2, 1.0);
    }
    length -= part;
  }
}

/// Each component within [-most, most].
inline Eigen::Vector3d anyVector(Random& random, double most) {
  return most * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

/// An arm of 2 to 4 tubes that fit into each other, with a random base pose and a tool.
inline kinematics::ConcentricTubeArm randomArm(Random& random) {
  kinematics::ConcentricTubeArm arm;
  const int n = random.integer(2, 4);
  double inner = random.uniform(0.5e-3, 1.0e-3), length = random.uniform(0.3, 0.5);
  for (int i = 0; i < n; ++i) {
    kinematics::Tube tube;
    tube.inner_diameter = inner;
    tube.outer_diameter = inner + random.uniform(0.1e-3, 0.4e-3);
    tube.youngs_modulus = random.uniform(40e9, 80e9);
    tube.poisson_ratio = random.uniform(0.2, 0.5);
    addRandomSections(tube, length, random);
    arm.tubes.push_back(tube);
    inner = tube.outer_diameter + random.uniform(0.02e-3, 0.1e-3);
    length *= random.uniform(0.5, 0.9);
  }
  const auto pose = [&] {
    Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
    t.linear() = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
    t.translation() = anyVector(random, 0.05);
    return t;
  };
  arm.base = pose();
  arm.tool = pose();
  return arm;
}

/// The same arm with helices: most of its curved sections get a torsion of either sign.
inline kinematics::ConcentricTubeArm helical(kinematics::ConcentricTubeArm arm, Random& random) {
  for (kinematics::Tube& tube : arm.tubes) {
    for (kinematics::TubeSection& section : tube.sections) {
      if (section.curvature != 0.0 && random.chance(0.8))
        section.helix_torsion = random.uniform(-40.0, 40.0);
    }
  }
  return arm;
}

/// A random arm, every third one of helices.
inline kinematics::ConcentricTubeArm anyTubes(Random& random) {
  const kinematics::ConcentricTubeArm arm = randomArm(random);
  Random own(static_cast<std::uint32_t>(1e9 * arm.tubes[0].outer_diameter));  // what `random` draws next stays the same
  return own.chance(1.0 / 3.0) ? helical(arm, own) : arm;
}

inline safety::ArmLimits limitsOf(const kinematics::ConcentricTubeArm& arm,
                                  double velocity = safety::kUnlimited,
                                  double acceleration = safety::kUnlimited) {
  safety::TubeLimitSpec spec;
  for (const kinematics::Tube& tube : arm.tubes) {
    spec.tube_length.push_back(tube.length());
    spec.stage_minimum.push_back(-tube.length());
    spec.stage_maximum.push_back(0.0);
  }
  spec.carriage_spacing.assign(arm.tubes.size() - 1, 0.0);
  spec.minimum_extension.assign(arm.tubes.size() - 1, 0.0);
  spec.translation.velocity = velocity;
  spec.translation.approach_acceleration = acceleration;
  return safety::makeTubeLimits(spec);
}

/// One arm of Alsaka et al. 2024, Table 1, with the curvatures of the preset ark2024; `y` of its base, m.
inline kinematics::ConcentricTubeArm arkArm(double y) {
  kinematics::ConcentricTubeArm arm;
  arm.tubes = {{1.524e-3, 1.3e-3, 58e9, 0.6, {}}, {1.8e-3, 1.62e-3, 58e9, 0.6, {}}, {2.164e-3, 2.0e-3, 58e9, 0.6, {}}};
  constexpr double kStraight[] = {0.387, 0.267, 0.149}, kCurvature[] = {10.0, 5.0, 7.0};
  for (int i = 0; i < 3; ++i) {
    arm.tubes[i].addSection(kStraight[i], 0.0);
    arm.tubes[i].addSection(0.05, kCurvature[i]);
  }
  arm.base.translation() = Eigen::Vector3d(0, y, 0);
  return arm;
}

/// Table 2: configuration 0, 1, 2 of arm 0, 1.
inline Eigen::VectorXd arkStart(int configuration, int arm) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  Eigen::VectorXd q(6);
  switch (2 * configuration + arm) {
    case 0:
      q << -0.1, -0.08, -0.05, 45 * kDegree, 45 * kDegree, 45 * kDegree;
      break;
    case 1:
      q << -0.08, -0.06, -0.03, 45 * kDegree, 45 * kDegree, 45 * kDegree;
      break;
    case 2:
      q << -0.15, -0.1, -0.05, 180 * kDegree, 90 * kDegree, 45 * kDegree;
      break;
    case 3:
      q << -0.13, -0.12, -0.1, 90 * kDegree, -60 * kDegree, -270 * kDegree;
      break;
    default:
      q << -0.25, -0.2, -0.12, 0, 0, 0;
      break;
  }
  return q;
}

}  // namespace tandem::test
