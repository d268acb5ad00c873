// SPDX-License-Identifier: Apache-2.0
/** @file Random catheters and poses. */
#pragma once

#include <numbers>

#include "kinematics/catheter/arm.h"
#include "kinematics/cosserat/rod_model.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::test {

/// Random pose with uniformly distributed orientation; the position within `reach` of the origin along each axis, m.
inline Eigen::Isometry3d anyPose(Random& random, double reach = 0.05) {
  Eigen::Quaterniond turn;
  do
    turn.coeffs() << anyVector(random, 1.0), random.uniform(-1.0, 1.0);
  while (turn.norm() > 1.0 || turn.norm() < 0.1);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = turn.normalized().toRotationMatrix();
  pose.translation() = anyVector(random, reach);
  return pose;
}

inline kinematics::catheter::Arm anyCatheter(Random& random) {
  kinematics::catheter::Arm arm;
  arm.bending_length = random.uniform(0.02, 0.1);
  arm.base = anyPose(random);
  arm.tool = anyPose(random, 0.02);
  return arm;
}

/// Insertion, roll and bend; sometimes exactly straight, or nearly.
inline Eigen::Vector3d anyCatheterJoints(Random& random) {
  double bend = random.uniform(-4.0, 4.0);
  if (random.chance(0.3))
    bend *= random.chance(0.3) ? 0.0 : std::pow(10.0, random.uniform(-12.0, -1.0));
  return {random.uniform(0.0, 0.3), random.uniform(-std::numbers::pi, std::numbers::pi), bend};
}

/// A rod of one to three soft sections, with random intrinsic curvature, tendons and tool.
inline kinematics::cosserat::Rod anyRod(Random& random) {
  namespace cosserat = kinematics::cosserat;
  cosserat::Rod rod;
  const int sections = random.integer(1, 3);
  double diameter = random.uniform(1.5e-3, 3e-3);
  for (int k = 0; k < sections; ++k, diameter *= random.uniform(0.7, 1.0)) {
    rod.sections.push_back(cosserat::tubeSection(random.uniform(0.03, 0.12), diameter, 0.6 * diameter,
                                                 random.uniform(0.2e9, 2e9), random.uniform(0.2, 0.49)));
    rod.sections.back().intrinsic_curvature = anyVector(random, random.chance(0.5) ? 5.0 : 0.0);
  }
  const int actuators = random.integer(0, cosserat::kMaxActuators);
  for (int k = 0; k < actuators; ++k) {
    cosserat::Actuator actuator;
    actuator.kind = random.chance(0.5) ? cosserat::Actuator::kTendon : cosserat::Actuator::kCurvature;
    actuator.section = random.integer(0, sections - 1);
    actuator.vector = anyVector(random, actuator.kind == cosserat::Actuator::kTendon ? 1e-3 : 5.0);
    if (actuator.kind == cosserat::Actuator::kTendon)
      actuator.vector.z() = 0.0;
    rod.actuators.push_back(actuator);
  }
  rod.tool = anyPose(random, 0.01);
  return rod;
}

/// Loads that bend a rod by about `strength` rad each.
inline kinematics::cosserat::RodInput anyInput(const kinematics::cosserat::Rod& rod, Random& random, double strength) {
  namespace cosserat = kinematics::cosserat;
  cosserat::RodInput input(rod);
  input.base = anyPose(random);
  const double length = cosserat::lengthOf(rod, input);
  const double moment = rod.sections.back().moment_stiffness.x() / length * strength;
  input.tip << anyVector(random, moment / length), anyVector(random, moment);
  for (std::size_t k = 0; k < rod.sections.size(); ++k) {
    if (random.chance(0.5))
      input.force[k] = anyVector(random, moment / (length * length));
    if (random.chance(0.5))
      input.moment[k] = anyVector(random, moment / length);
  }
  for (std::size_t k = 0; k < rod.actuators.size(); ++k) {
    const bool tendon = rod.actuators[k].kind == cosserat::Actuator::kTendon;
    input.inputs[static_cast<Eigen::Index>(k)] =
        tendon ? random.uniform(0.0, 0.5 * moment / 1e-3) : random.uniform(-1.0, 1.0);
  }
  return input;
}

}  // namespace tandem::test
