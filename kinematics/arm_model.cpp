// SPDX-License-Identifier: Apache-2.0
#include "kinematics/arm_model.h"

#include <cmath>
#include <numbers>

namespace tandem::kinematics {

std::string_view describe(ModelStatus status) {
  switch (status) {
    case ModelStatus::kOk:
      return "ok";
    case ModelStatus::kWrongSize:
      return "wrong number of joints";
    case ModelStatus::kNotFinite:
      return "a joint position or a component of the load is NaN or infinite";
    case ModelStatus::kNotExtended:
      return "tube 1 ends at or behind the entry point, or a rod has no length";
    case ModelStatus::kProtruded:
      return "a tube's proximal end is in front of the entry point (beta > 0)";
    case ModelStatus::kInnerInside:
      return "an outer tube ends ahead of an inner one";
    case ModelStatus::kNotConverged:
      return "no equilibrium was found";
    case ModelStatus::kCarriesNoLoad:
      return "the rigid model carries no load, use the compliant one";
    case ModelStatus::kDistalInside:
      return "the bending end is not wholly in front of the entry point, insertion is below zero";
    case ModelStatus::kTendonPushes:
      return "a tendon's tension is below zero";
  }
  return "unknown";
}

int Branch::winding(int tube) const noexcept {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return static_cast<int>(std::floor((end_angle[tube] - end_angle[0]) / kTurn + 0.5));
}

ModelStatus ArmModel::tip(const JointsRef& q, Tip& tip) const noexcept {
  Branch cold;
  return this->tip(q, cold, tip);
}

ModelStatus ArmModel::shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const {
  Branch cold;
  return this->shape(q, Wrench::Zero(), cold, points, shape);
}

ModelStatus ArmModel::loadedTip(const JointsRef& q,
                                const Wrench& wrench,
                                Branch& branch,
                                LoadedTip& tip) const noexcept {
  if (!wrench.allFinite())
    return ModelStatus::kNotFinite;
  if (!wrench.isZero(0.0))
    return ModelStatus::kCarriesNoLoad;
  tip.compliance.setZero();
  return this->tip(q, branch, tip);
}

}  // namespace tandem::kinematics
