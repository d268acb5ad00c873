// SPDX-License-Identifier: Apache-2.0
#include "kinematics/cosserat/rod.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace tandem::kinematics::cosserat {

namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& found, const std::string& expected) {
  throw std::invalid_argument("rod, " + what + ": found " + found + ", expected " + expected);
}

void checkSection(const Section& section, int index) {
  const std::string name = "section " + std::to_string(index + 1);
  if (!(section.length >= 0.0) || !std::isfinite(section.length))
    refuse(name + ", length", std::to_string(section.length), "a number of metres, not below zero");
  if (!(section.moment_stiffness.minCoeff() > 0.0) || !section.moment_stiffness.allFinite())
    refuse(name + ", moment stiffness", "a number not above zero or not finite", "three numbers above zero");
  if (!(section.force_stiffness.minCoeff() > 0.0) || !section.force_stiffness.allFinite())
    refuse(name + ", force stiffness", "a number not above zero or not finite", "three numbers above zero");
  if (!section.intrinsic_curvature.allFinite())
    refuse(name + ", intrinsic curvature", "a number that is not finite", "three numbers");
}

}  // namespace

Section tubeSection(double length,
                    double outer_diameter,
                    double inner_diameter,
                    double youngs_modulus,
                    double poisson) {
  const double outer = outer_diameter * outer_diameter, inner = inner_diameter * inner_diameter;
  const double area = std::numbers::pi / 4.0 * (outer - inner);
  const double inertia = std::numbers::pi / 64.0 * (outer * outer - inner * inner);
  const double shear_modulus = youngs_modulus / (2.0 * (1.0 + poisson));
  Section section;
  section.length = length;
  section.outer_radius = 0.5 * outer_diameter;
  section.moment_stiffness << youngs_modulus * inertia, youngs_modulus * inertia, 2.0 * shear_modulus * inertia;
  section.force_stiffness << shear_modulus * area, shear_modulus * area, youngs_modulus * area;
  return section;
}

void checkRod(const Rod& rod) {
  const int sections = static_cast<int>(rod.sections.size()), actuators = static_cast<int>(rod.actuators.size());
  if (sections < 1 || sections > kMaxSections)
    refuse("sections", std::to_string(sections), "1 to " + std::to_string(kMaxSections));
  if (actuators > kMaxActuators)
    refuse("actuators", std::to_string(actuators), "at most " + std::to_string(kMaxActuators));
  double length = 0.0;
  for (int k = 0; k < sections; ++k) {
    checkSection(rod.sections[k], k);
    length += rod.sections[k].length;
  }
  if (!(length > 0.0))
    refuse("sections", "lengths with the sum 0 m", "a sum above 0 m");
  for (int k = 0; k < actuators; ++k) {
    const Actuator& actuator = rod.actuators[k];
    const std::string name = "actuator " + std::to_string(k + 1);
    if (actuator.section < 0 || actuator.section >= sections)
      refuse(name + ", section", std::to_string(actuator.section + 1), "1 to " + std::to_string(sections));
    if (!actuator.vector.allFinite())
      refuse(name + ", vector", "a number that is not finite", "three numbers");
    if (actuator.kind == Actuator::kTendon && actuator.vector.z() != 0.0)
      refuse(name + ", vector", "z = " + std::to_string(actuator.vector.z()), "a tendon in the plane z = 0");
  }
  if (!rod.tool.matrix().allFinite())
    refuse("tool", "a number that is not finite", "a pose");
}

RodInput::RodInput(const Rod& rod) : first_length(rod.sections.empty() ? 0.0 : rod.sections.front().length) {
  force.fill(Eigen::Vector3d::Zero());
  moment.fill(Eigen::Vector3d::Zero());
}

}  // namespace tandem::kinematics::cosserat
