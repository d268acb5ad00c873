// SPDX-License-Identifier: Apache-2.0
#include "kinematics/compliant_model.h"

namespace tandem::kinematics {
namespace {

void remember(const JointsRef& q, const Wrench& wrench, const LoadedEquilibrium::Root& root, Branch& branch) {
  branch.known = true;
  branch.snapped = root.snapped;
  branch.snap_energy = branch.snap_distance = 0.0;
  branch.q = q;
  branch.end_angle = root.guess.theta;
  branch.by_translation = root.by_translation.topRows<kMaxTubes>();
  branch.by_rotation = root.by_rotation.topRows<kMaxTubes>();
  branch.turn_by_translation = root.by_translation.bottomRows<3>();
  branch.turn_by_rotation = root.by_rotation.bottomRows<3>();
  branch.by_load = root.by_wrench;
  branch.load = wrench;
  branch.end_frame = root.guess.end;
}

}  // namespace

Wrench CompliantModel::inArm(const Wrench& wrench) const {
  Wrench turned;
  turned << arm_.base.linear().transpose() * wrench.head<3>(), arm_.base.linear().transpose() * wrench.tail<3>();
  return turned;
}

ModelStatus CompliantModel::loadedTip(const JointsRef& q,
                                      const Wrench& wrench,
                                      Branch& branch,
                                      LoadedTip& tip) const noexcept {
  if (const ModelStatus status = checkJoints(arm_, q); status != ModelStatus::kOk)
    return status;
  if (!wrench.allFinite())
    return ModelStatus::kNotFinite;
  const Wrench load = inArm(wrench);
  LoadedEquilibrium::Root root;
  if (const ModelStatus status = loaded_.find(q, load, branch, root); status != ModelStatus::kOk)
    return status;
  remember(q, load, root, branch);

  const Eigen::Matrix3d& base = arm_.base.linear();
  tip.pose.linear() = base * root.guess.end *
                      Eigen::AngleAxisd(root.guess.theta[0], Eigen::Vector3d::UnitZ()).toRotationMatrix() *
                      arm_.tool.linear();
  tip.pose.translation() = arm_.base * root.tip;
  Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = base;
  const int n = arm_.tubeCount();
  tip.jacobian.resize(6, 2 * n);
  tip.jacobian.leftCols(n) = (turn * root.tip_by_translation).leftCols(n);
  tip.jacobian.rightCols(n) = (turn * root.tip_by_rotation).leftCols(n);
  tip.compliance = turn * root.compliance * turn.transpose();
  tip.stability = root.stability;
  tip.stability_at = root.stability_at;
  tip.conjugate_points = root.conjugate_points;
  return ModelStatus::kOk;
}

/// Fills `shape`, whose points have their s.
ModelStatus CompliantModel::loadedShape(const JointsRef& q,
                                        const Wrench& wrench,
                                        Branch& branch,
                                        std::vector<ShapePoint>& shape) const {
  const Wrench load = inArm(wrench);
  LoadedEquilibrium::Root root;
  if (const ModelStatus status = loaded_.find(q, load, branch, root); status != ModelStatus::kOk)
    return status;
  Segmentation parts;
  segment(arm_, q, parts);
  const LoadedSweep sweep(arm_, parts, TubeJoints(q).beta, root.guess, load, LoadedDepth::kPath, &shape);
  remember(q, load, root, branch);
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.linear() = root.guess.end;
  end.translation() = sweep.endPosition();
  for (ShapePoint& point : shape)
    point.pose = arm_.base * end * point.pose * Eigen::AngleAxisd(point.psi[0], Eigen::Vector3d::UnitZ());
  return ModelStatus::kOk;
}

/// Continues a branch under a load to zero load.
ModelStatus CompliantModel::unload(const JointsRef& q, Branch& branch) const noexcept {
  if (!branch.known || branch.load.isZero(0.0))
    return ModelStatus::kOk;
  LoadedTip tip;
  return loadedTip(q, Wrench::Zero(), branch, tip);
}

}  // namespace tandem::kinematics
