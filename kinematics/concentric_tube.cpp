// SPDX-License-Identifier: Apache-2.0
#include "kinematics/concentric_tube.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace tandem::kinematics {

TubeJoints::TubeJoints(const Eigen::Ref<const Eigen::VectorXd>& q) {
  const Eigen::Index n = q.size() / 2;
  beta.head(n) = q.head(n);
  alpha.head(n) = q.tail(n);
}

double Tube::length() const {
  double sum = 0.0;
  for (const TubeSection& section : sections)
    sum += section.length;
  return sum;
}

double Tube::bendingStiffness() const {
  return youngs_modulus * std::numbers::pi * (std::pow(outer_diameter, 4) - std::pow(inner_diameter, 4)) / 64.0;
}

double Tube::torsionalStiffness() const { return bendingStiffness() / (1.0 + poisson_ratio); }

void Tube::addSection(double section_length, double curvature, double helix_torsion) {
  sections.push_back({section_length, curvature, bendingStiffness(), torsionalStiffness(), helix_torsion});
}

double Tube::helixAngle(double along) const {
  double angle = 0.0;
  for (const TubeSection& section : sections) {
    angle += section.helix_torsion * std::clamp(along, 0.0, section.length);
    along -= section.length;
  }
  return angle;
}

bool Tube::isHelical() const {
  return std::ranges::any_of(sections, [](const TubeSection& section) { return section.helix_torsion != 0.0; });
}

void checkArm(const ConcentricTubeArm& arm) {
  if (arm.tubeCount() < 2 || arm.tubeCount() > kMaxTubes)
    throw std::invalid_argument("an arm has 2 to 4 tubes, found " + std::to_string(arm.tubeCount()));
  for (int i = 0; i < arm.tubeCount(); ++i) {
    const auto& sections = arm.tubes[i].sections;
    const std::string tube = "tube " + std::to_string(i + 1);
    if (sections.empty() || static_cast<int>(sections.size()) > kMaxTubeSections)
      throw std::invalid_argument(tube + " has 1 to 8 sections, found " + std::to_string(sections.size()));
    for (std::size_t k = 0; k < sections.size(); ++k) {
      const TubeSection& section = sections[k];
      for (const double value : {section.length, section.bending_stiffness, section.torsional_stiffness}) {
        if (!(value > 0.0) || !std::isfinite(value) || !std::isfinite(section.curvature) ||
            !std::isfinite(section.helix_torsion)) {
          throw std::invalid_argument(tube + ", section " + std::to_string(k + 1) +
                                      ": length and stiffnesses are above zero, and every number is finite");
        }
      }
      if (section.curvature == 0.0 && section.helix_torsion != 0.0)
        throw std::invalid_argument(tube + ", section " + std::to_string(k + 1) +
                                    ": a straight section has no torsion");
    }
  }
}

}  // namespace tandem::kinematics
