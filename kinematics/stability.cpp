// SPDX-License-Identifier: Apache-2.0
#include "kinematics/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kinematics/compliant_model.h"
#include "kinematics/end_angle_sweep_impl.h"
#include "kinematics/taylor_step_impl.h"

namespace tandem::kinematics {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

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

/// Turn of one tube, rad, up to `most`, after which the branch cannot be followed any more; `most` if it can.
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

/// Elastic energy by quadrature over the shape, J.
double energyOf(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q, const TubeVector& theta) {
  constexpr int kPieces = 4;
  const GaussLegendre& rule = GaussLegendre::rule(8);
  std::vector<ShapePoint> points;
  std::vector<double> weights;
  std::vector<int> intervals;
  for (int k = 0; k < parts.count; ++k) {
    const double start = parts.interval[k].start, piece = (parts.interval[k].end - start) / kPieces;
    for (int j = 0; j < kPieces * rule.count && piece > 0.0; ++j) {
      points.emplace_back().s = start + piece * (j / rule.count + rule.node[j % rule.count]);
      weights.push_back(piece * rule.weight[j % rule.count]);
      intervals.push_back(k);
    }
  }
  const TubeJoints joints(q);
  const EndAngleSweep<double> sweep(arm, parts, joints.beta, theta, 1.0, StepDepth::kPose, &points);
  double energy = 0.0;
  for (std::size_t j = 0; j < points.size(); ++j) {
    const Segmentation::Interval& interval = parts.interval[intervals[j]];
    for (int i = 0; i < arm.tubeCount(); ++i) {
      if (interval.section[i] == Segmentation::kAbsent)
        continue;
      const TubeSection& section = arm.tubes[i].sections[interval.section[i]];
      const Eigen::Vector2d own =
          section.curvature * Eigen::Vector2d(-std::sin(points[j].psi[i]), std::cos(points[j].psi[i]));
      energy += weights[j] * (0.5 * section.bending_stiffness * (points[j].curvature - own).squaredNorm() +
                              0.5 * points[j].moment[i] * points[j].moment[i] / section.torsional_stiffness);
    }
  }
  // Behind the entry point a tube's moment is constant: t F t / 2, and t F is the angle twisted there.
  return energy + 0.5 * sweep.entryMoment().dot(sweep.entryAngle() - sweep.baseAngle());
}

}  // namespace

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
  double least = kTurn;
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

std::vector<EquilibriumInfo> CompliantModel::equilibria(const JointsRef& q) const {
  std::vector<EquilibriumInfo> found;
  if (checkJoints(arm_, q) != ModelStatus::kOk)
    return found;
  Segmentation parts;
  segment(arm_, q, parts);
  const int n = arm_.tubeCount(), across = n == 4 ? 16 : 32;  // starts per tube over two turns
  int starts = 1;
  for (int i = 1; i < n; ++i)
    starts *= across;
  constexpr double kLongestFix = 2.0, kSame = 1e-5;
  Equilibrium::Root cold;
  const bool answered = equilibrium_.find(q, Branch{}, cold) == ModelStatus::kOk;
  for (int start = answered ? -1 : 0; start < starts; ++start) {  // -1: what a cold start finds
    Equilibrium::Root root;
    root.theta = start < 0 ? cold.theta : TubeJoints(q).alpha;
    for (int i = 1, rest = start; start >= 0 && i < n; ++i, rest /= across)
      root.theta[i] += kTurn * (2.0 * (rest % across) / across - 1.0);
    int conjugate_points = 0;
    if (!equilibrium_.correct(parts, q, 1.0, kLongestFix, root, conjugate_points))
      continue;
    const bool known = std::any_of(found.begin(), found.end(), [&](const EquilibriumInfo& info) {
      return (info.branch.end_angle - root.theta).cwiseAbs().maxCoeff() < kSame;
    });
    if (known)
      continue;
    EquilibriumInfo& info = found.emplace_back();
    root.remember(q, info.branch);
    for (int i = 0; i < n; ++i)
      info.winding[i] = info.branch.winding(i);
    info.energy = energyOf(arm_, parts, q, root.theta);
    const EndAngleSweep<double> sweep(arm_, parts, TubeJoints(q).beta, root.theta, 1.0, StepDepth::kAngles);
    info.stability = sweep.determinant().minimum();
    info.conjugate_points = sweep.determinant().conjugatePoints();
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.energy < b.energy; });
  return found;
}

}  // namespace tandem::kinematics
