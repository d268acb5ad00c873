// SPDX-License-Identifier: Apache-2.0
#include "kinematics/catheter/elastic.h"

#include <cmath>
#include <stdexcept>

namespace tandem::kinematics::catheter {

using cosserat::Vector6;
using Eigen::Vector3d;

namespace {

cosserat::Rod withTool(const ElasticArm& arm) {
  checkArm(arm.arm);
  if (!(arm.wire_elasticity >= 0.0) || !std::isfinite(arm.wire_elasticity))
    throw std::invalid_argument("elasticity of the pull wires: found " + std::to_string(arm.wire_elasticity) +
                                ", expected a number not below zero");
  cosserat::Rod rod = rodOf(arm);
  rod.tool = arm.arm.tool;
  return rod;
}

}  // namespace

std::string_view nameOf(Actuation actuation) {
  return actuation == Actuation::kDisplacement ? "displacement" : "tension";
}

cosserat::Rod rodOf(const ElasticArm& arm) {
  cosserat::Rod rod;
  rod.sections = {arm.proximal, arm.distal};
  rod.sections[0].length = 0.0;
  rod.sections[0].intrinsic_curvature.setZero();
  rod.sections[1].length = arm.arm.bending_length;
  rod.actuators = {{cosserat::Actuator::kCurvature, 1, Vector3d::UnitY() / arm.arm.bending_length},
                   {cosserat::Actuator::kCurvature, 1, Vector3d::UnitX() / arm.arm.bending_length}};
  return rod;
}

void actuate(const ElasticArm& arm, double bend, const cosserat::Inputs& share, cosserat::RodInput& input) {
  if (arm.actuation == Actuation::kDisplacement)
    input.wire = {share, bend, arm.wire_elasticity};
  else
    input.inputs += bend * share;
}

ElasticCatheter::ElasticCatheter(const ElasticArm& arm) : arm_(arm), model_(withTool(arm)) {}

cosserat::RodInput ElasticCatheter::inputOf(const JointsRef& q, const Wrench& wrench) const {
  cosserat::RodInput input(model_.rod());
  input.base = arm_.arm.base * Eigen::AngleAxisd(q[kRoll], Vector3d::UnitZ());
  input.first_length = q[kInsertion];
  actuate(arm_, q[kBend], cosserat::Inputs::UnitX(), input);
  input.tip = wrench;
  return input;
}

ModelStatus ElasticCatheter::tip(const JointsRef& q,
                                 const Wrench& wrench,
                                 cosserat::RodBranch& branch,
                                 LoadedTip& tip) const noexcept {
  ModelStatus status = checkJoints(q);
  if (status != ModelStatus::kOk)
    return status;
  cosserat::RodAnswer answer;
  status = model_.solve(inputOf(q, wrench), branch, answer);
  if (status != ModelStatus::kOk)
    return status;
  tip = LoadedTip();
  tip.pose = answer.tip;
  tip.compliance = answer.compliance;
  tip.conjugate_points = answer.conjugate_points;
  tip.jacobian.resize(6, kJoints);
  tip.jacobian << answer.by_length, answer.by_base.rightCols<3>() * arm_.arm.base.linear().col(2),
      arm_.actuation == Actuation::kDisplacement ? answer.by_displacement : Vector6(answer.by_input.col(0));
  return status;
}

ModelStatus ElasticCatheter::shape(const JointsRef& q,
                                   const Wrench& wrench,
                                   cosserat::RodBranch& branch,
                                   int points,
                                   std::vector<cosserat::RodPoint>& shape) const {
  const ModelStatus status = checkJoints(q);
  return status == ModelStatus::kOk ? model_.shape(inputOf(q, wrench), branch, points, shape) : status;
}

}  // namespace tandem::kinematics::catheter
