// SPDX-License-Identifier: Apache-2.0
#include "kinematics/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kinematics/compliant_model.h"
#include "kinematics/detail/end_angle_sweep_impl.h"
#include "kinematics/detail/taylor_step_impl.h"

namespace tandem::kinematics {
namespace {

constexpr double kFullTurn = 2.0 * std::numbers::pi;

/// Determinant with derivatives by all joints, along the branch.
Gradient gradientOf(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q, const Branch& branch) {
  const int n = arm.tubeCount();
  const TubeJoints joints(q);
  Eigen::Matrix<Dual, kMaxTubes, 1> beta, theta;
  for (int i = 0; i < kMaxTubes; ++i) {
    beta[i] = Dual(joints.beta[i], 2 * kMaxTubes, i);
    theta[i].value() = branch.end_angle[i];
    theta[i].derivatives() << branch.by_translation.row(i).transpose(), branch.by_rotation.row(i).transpose();
  }
  const EndAngleSweep<Dual> sweep(arm, parts, beta, theta, 1.0, StepDepth::kAngles);
  const auto derivatives = sweep.determinant().minimum().derivatives();
  Gradient gradient = Gradient::Zero(2 * n);
  if (derivatives.size() == 2 * kMaxTubes) {
    gradient.head(n) = derivatives.head(n);
    gradient.tail(n) = derivatives.segment(kMaxTubes, n);
  }
  return gradient;
}

/// Rotation of one tube, rad, up to `most`, beyond which the branch cannot be followed; `most` if it can.
double turnLeft(const Equilibrium& equilibrium,
                const Segmentation& parts,
                const JointsRef& q,
                const Equilibrium::Root& start,
                int joint,
                double sense,
                double most) {
  constexpr double kLongestMove = 0.1, kLongestFix = 0.05, kResolution = 1e-6;
  constexpr int kMaxSteps = 2000;
  const int tube = joint - static_cast<int>(q.size()) / 2;
  Equilibrium::Root reached = start;
  safety::ArmVector next = q;
  double done = 0.0, step = most;
  for (int steps = 0; steps < kMaxSteps && done < most; ++steps) {
    const TubeVector velocity = sense * reached.by_rotation.col(tube);
    step = std::min({step, most - done, kLongestMove / std::max(velocity.cwiseAbs().maxCoeff(), 1e-9)});
    next[joint] = q[joint] + sense * (done + step);
    Equilibrium::Root root = reached;
    root.theta += step * velocity;
    int conjugate_points = 0;
    safety::ArmVector turn = safety::ArmVector::Zero(q.size());
    turn[joint] = sense * step;
    if (equilibrium.correct(parts, next, 1.0, kLongestFix, root, conjugate_points) && conjugate_points == 0 &&
        Equilibrium::connected(reached, root, turn)) {
      reached = root;
      done += step;
      step *= 2.0;
    } else if ((step *= 0.5) < kResolution) {
      break;
    }
  }
  return done;
}

}  // namespace

Gradient CompliantModel::stabilityGradient(const JointsRef& q, const Branch& branch) const {
  if (checkJoints(arm_, q) != ModelStatus::kOk || !branch.known)
    return Gradient::Zero(arm_.jointCount());
  Segmentation parts;
  segment(arm_, q, parts);
  return gradientOf(arm_, parts, q, branch);
}

ModelStatus CompliantModel::stability(const JointsRef& q, Branch& branch, Stability& result) const noexcept {
  Tip tip;
  if (const ModelStatus status = this->tip(q, branch, tip); status != ModelStatus::kOk)
    return status;
  Segmentation parts;
  segment(arm_, q, parts);
  result.minimum = tip.stability;
  result.at = tip.stability_at;
  result.conjugate_points = tip.conjugate_points;
  result.gradient = gradientOf(arm_, parts, q, branch);
  result.rotation_left = std::numeric_limits<double>::infinity();
  result.rotation_tube = result.rotation_sense = 0;
  Equilibrium::Root root;
  root.theta = branch.end_angle;
  root.by_translation = branch.by_translation;
  root.by_rotation = branch.by_rotation;
  double least = kFullTurn;
  for (int i = 0; i < arm_.tubeCount(); ++i) {
    for (const int sense : {1, -1}) {
      const double left = turnLeft(equilibrium_, parts, q, root, arm_.tubeCount() + i, sense, least);
      if (left < least) {
        least = result.rotation_left = left;
        result.rotation_tube = i;
        result.rotation_sense = sense;
      }
    }
  }
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics
