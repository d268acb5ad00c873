// SPDX-License-Identifier: Apache-2.0
#include "sim/tube_friction.h"

#include <utility>

#include "kinematics/tube_loads.h"
#include "sim/actuation.h"

namespace tandem::sim {

TubeFriction::TubeFriction(kinematics::ConcentricTubeArm plant, const kinematics::ConcentricTubeArm& nominal, double mu)
    : arm_(std::move(plant)), mu_(mu) {
  for (int i = 0; i < arm_.tubeCount(); ++i) {
    const auto tube = static_cast<std::size_t>(i);
    const auto& sections = nominal.tubes[tube].sections;
    for (std::size_t k = 0; k < sections.size() && sections[k].curvature == 0.0; ++k)
      compliance_[i] += arm_.tubes[tube].sections[k].length / arm_.tubes[tube].sections[k].torsional_stiffness;
  }
}

const safety::ArmVector& TubeFriction::follow(const safety::ArmVector& q) noexcept {
  if (tubes_.size() != q.size()) {
    tubes_ = q;
    return tubes_;
  }
  const int n = arm_.tubeCount();
  tubes_.head(n) = q.head(n);
  for (int i = 0; i < n; ++i)
    tubes_[n + i] = withBacklash(tubes_[n + i], q[n + i], 2.0 * wind_up_[i]);
  return tubes_;
}

void TubeFriction::update(const safety::ArmVector& q, const kinematics::Branch& branch) noexcept {
  kinematics::Segmentation parts;
  kinematics::segment(arm_, q, parts);
  const kinematics::TubeJoints joints(q);
  const kinematics::TubeVector ends = branch.known ? branch.end_angle : kinematics::untwistedEnds(arm_, parts, q);
  const kinematics::TubeLoads loads = kinematics::tubeLoads(arm_, parts, joints.beta, ends, branch.known);
  for (int i = 0; i < arm_.tubeCount(); ++i) {
    const double radius = 0.5 * arm_.tubes[static_cast<std::size_t>(i)].outer_diameter;
    wind_up_[i] = mu_ * (loads.couple[i] + radius * loads.force[i]) * compliance_[i];
  }
}

}  // namespace tandem::sim
