// SPDX-License-Identifier: Apache-2.0
#include "kinematics/compliant_model.h"

#include <algorithm>
#include <stdexcept>

#include "kinematics/swept_end.h"

namespace tandem::kinematics {
namespace {

/// A residual correction of the end angles below this is applied to first order, rad.
constexpr double kLinear = 1e-7;
/// Joint motions that rotate no end by more than this use the prediction, if it is accurate enough, rad.
constexpr double kSmallMove = 3e-4;

/// Pose and derivatives at root.theta, with a first-order correction of the remaining residual.
/// @return the largest correction, rad.
double evaluate(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q, SweptEnd& answer) {
  const TubeJoints joints(q);
  const EndAngleSweep<double> sweep(arm, parts, joints.beta, answer.root.theta, 1.0, StepDepth::kPose);
  answer.root.linearise(sweep);
  const TubeVector correction = answer.root.by_rotation * (joints.alpha - sweep.baseAngle());
  const Eigen::Matrix<double, 6, kMaxTubes> by_end = sweep.twistByEnd();
  answer.by_rotation = by_end * answer.root.by_rotation;
  answer.by_translation = sweep.twistByTranslation() + by_end * answer.root.by_translation;
  answer.root.theta += correction;
  const Eigen::Matrix<double, 6, 1> shift = by_end * correction;
  answer.position = sweep.endPosition();
  answer.position += shift.head<3>() + shift.tail<3>().cross(answer.position);
  answer.rotation = sweep.endRotation();
  if (const double angle = shift.tail<3>().norm(); angle > 0.0)
    answer.rotation = (Eigen::AngleAxisd(angle, shift.tail<3>() / angle) * answer.rotation).eval();
  answer.determinant = sweep.determinant();
  return correction.cwiseAbs().maxCoeff();
}

/// A small move along a branch: uses the prediction if it is accurate enough.
bool predict(const ConcentricTubeArm& arm,
             const Segmentation& parts,
             const JointsRef& q,
             const Branch& branch,
             SweptEnd& answer) {
  if (!branch.known || branch.q.size() != q.size())
    return false;
  answer.root.theta = branch.end_angle;
  answer.root.by_translation = branch.by_translation;
  answer.root.by_rotation = branch.by_rotation;
  const TubeVector move = answer.root.change(q - branch.q);
  answer.root.theta += move;
  return move.cwiseAbs().maxCoeff() < kSmallMove && evaluate(arm, parts, q, answer) < kLinear &&
         answer.determinant.conjugatePoints() == 0;
}

}  // namespace

CompliantModel::CompliantModel(ConcentricTubeArm arm)
    : TubeModel(std::move(arm)), rigid_(arm_), equilibrium_(arm_), loaded_(arm_, equilibrium_) {}

ModelStatus CompliantModel::tip(const JointsRef& q, Branch& branch, Tip& tip) const noexcept {
  if (const ModelStatus status = checkJoints(arm_, q); status != ModelStatus::kOk)
    return status;
  if (const ModelStatus status = unload(q, branch); status != ModelStatus::kOk)
    return status;
  Segmentation parts;
  segment(arm_, q, parts);
  SweptEnd answer;
  if (!predict(arm_, parts, q, branch, answer)) {
    if (const ModelStatus status = equilibrium_.find(q, branch, answer.root); status != ModelStatus::kOk)
      return status;
    for (int i = 0; i < 3 && evaluate(arm_, parts, q, answer) >= kLinear; ++i) {
    }
  }
  answer.root.remember(q, branch);
  answer.toTool(arm_, tip);
  return ModelStatus::kOk;
}

ModelStatus CompliantModel::shape(const JointsRef& q,
                                  const Wrench& wrench,
                                  Branch& branch,
                                  int points,
                                  std::vector<ShapePoint>& shape) const {
  if (const ModelStatus status = checkJoints(arm_, q); status != ModelStatus::kOk)
    return status;
  if (!wrench.allFinite())
    return ModelStatus::kNotFinite;
  Segmentation parts;
  segment(arm_, q, parts);
  spaceEvenly(parts.length(), points, shape);
  if (!wrench.isZero(0.0))
    return loadedShape(q, wrench, branch, shape);
  if (const ModelStatus status = unload(q, branch); status != ModelStatus::kOk)
    return status;
  Equilibrium::Root root;
  if (const ModelStatus status = equilibrium_.find(q, branch, root); status != ModelStatus::kOk)
    return status;
  const EndAngleSweep<double> sweep(arm_, parts, TubeJoints(q).beta, root.theta, 1.0, StepDepth::kPose, shape);
  root.linearise(sweep);
  root.remember(q, branch);
  placeSamples(arm_, sweep, shape);
  return ModelStatus::kOk;
}

ModelStatus CompliantModel::tipFromEndAngles(const JointsRef& ends,
                                             Eigen::Ref<Eigen::VectorXd> alpha,
                                             Tip& tip) const noexcept {
  if (const ModelStatus status = checkJoints(arm_, ends); status != ModelStatus::kOk)
    return status;
  if (alpha.size() != arm_.tubeCount())
    return ModelStatus::kWrongSize;
  Segmentation parts;
  segment(arm_, ends, parts);
  const TubeJoints given(ends);
  const EndAngleSweep<double> sweep(arm_, parts, given.beta, given.alpha, 1.0, StepDepth::kPose);
  alpha = sweep.baseAngle().head(arm_.tubeCount());
  SweptEnd(sweep, given.alpha).toTool(arm_, tip);
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics
