// SPDX-License-Identifier: Apache-2.0
#include "kinematics/concentric_tube.h"

#include <cmath>
#include <numbers>

namespace tandem::kinematics {

double Tube::bendingStiffness() const {
  return youngs_modulus * std::numbers::pi / 64.0 * (std::pow(outer_diameter, 4) - std::pow(inner_diameter, 4));
}

double Tube::torsionalStiffness() const { return bendingStiffness() / (1.0 + poisson_ratio); }

}  // namespace tandem::kinematics
