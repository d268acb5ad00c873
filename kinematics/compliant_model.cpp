// SPDX-License-Identifier: Apache-2.0
#include "kinematics/compliant_model.h"

#include <algorithm>
#include <stdexcept>

namespace tandem::kinematics {
namespace {

/// A residual correction of the end angles below this is applied to first order, rad.
constexpr double kLinear = 1e-7;
/// Joint motions that rotate no end by more than this use the prediction, if it is accurate enough, rad.
constexpr double kSmallMove = 3e-4;

struct Answer {
  Equilibrium::Root root;
  Eigen::Matrix3d rotation;  ///< of tube 1's end, torsion-free, arm base frame
  Eigen::Vector3d position;
  /// Of that frame by beta and by alpha, about the base's origin, arm base frame.
  Eigen::Matrix<double, 6, kMaxTubes> by_translation, by_rotation;
  DeterminantTrack<double> determinant;
};

/// Pose and derivatives at root.theta, with a first-order correction of the remaining residual.
/// @return the largest correction, rad.
double evaluate(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q, Answer& answer) {
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

/// From the torsion-free end frame to the tool: the end rotates with tube 1; twists become those of the tool's tip.
void toTool(const ConcentricTubeArm& arm, const Answer& answer, Tip& tip) {
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.linear() = answer.rotation * Eigen::AngleAxisd(answer.root.theta[0], Eigen::Vector3d::UnitZ()).toRotationMatrix();
  end.translation() = answer.position;
  tip.pose = arm.base * end * arm.tool;
  const Eigen::Vector3d tool = end * arm.tool.translation();
  const Eigen::Vector3d axis = answer.rotation.col(2);
  const int n = arm.tubeCount();
  tip.jacobian.resize(6, 2 * n);
  const auto column = [&](int j, const Eigen::Matrix<double, 6, 1>& twist, double roll) {
    const Eigen::Vector3d angular = twist.tail<3>() + roll * axis;
    const Eigen::Vector3d linear = twist.head<3>() + angular.cross(tool) - roll * axis.cross(answer.position);
    tip.jacobian.col(j).head<3>() = arm.base.linear() * linear;
    tip.jacobian.col(j).tail<3>() = arm.base.linear() * angular;
  };
  for (int i = 0; i < n; ++i) {
    column(i, answer.by_translation.col(i), answer.root.by_translation(0, i));
    column(n + i, answer.by_rotation.col(i), answer.root.by_rotation(0, i));
  }
  tip.stability = answer.determinant.minimum();
  tip.stability_at = answer.determinant.at();
  tip.conjugate_points = answer.determinant.conjugatePoints();
}

/// A small move along a branch: uses the prediction if it is accurate enough.
bool predict(const ConcentricTubeArm& arm,
             const Segmentation& parts,
             const JointsRef& q,
             const Branch& branch,
             Answer& answer) {
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
  Answer answer;
  if (!predict(arm_, parts, q, branch, answer)) {
    if (const ModelStatus status = equilibrium_.find(q, branch, answer.root); status != ModelStatus::kOk)
      return status;
    for (int i = 0; i < 3 && evaluate(arm_, parts, q, answer) >= kLinear; ++i) {
    }
  }
  answer.root.remember(q, branch);
  toTool(arm_, answer, tip);
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
  shape.resize(static_cast<std::size_t>(std::max(points, 2)));
  const double last = static_cast<double>(shape.size() - 1);
  for (std::size_t j = 0; j < shape.size(); ++j)
    shape[j].s = j + 1 == shape.size() ? parts.length() : parts.length() * static_cast<double>(j) / last;
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
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.linear() = sweep.endRotation();
  end.translation() = sweep.endPosition();
  for (ShapePoint& point : shape)
    point.pose = arm_.base * end * point.pose * Eigen::AngleAxisd(point.psi[0], Eigen::Vector3d::UnitZ());
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
  Answer answer;
  const EndAngleSweep<double> sweep(arm_, parts, given.beta, given.alpha, 1.0, StepDepth::kPose);
  answer.root.theta = given.alpha;
  answer.by_rotation = sweep.twistByEnd();
  answer.by_translation = sweep.twistByTranslation();
  answer.rotation = sweep.endRotation();
  answer.position = sweep.endPosition();
  answer.determinant = sweep.determinant();
  alpha = sweep.baseAngle().head(arm_.tubeCount());
  toTool(arm_, answer, tip);
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics
