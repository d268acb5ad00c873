// SPDX-License-Identifier: Apache-2.0
#include "kinematics/equilibrium.h"

#include <algorithm>
#include <cmath>

#include "kinematics/detail/relaxation.h"
#include "kinematics/tube_loads.h"

namespace tandem::kinematics {
namespace {

constexpr double kConverged = 1e-5;    ///< a correction below this leaves an error of its square, rad
constexpr double kLongestMove = 0.3;   ///< of an end angle in one step along a path, rad
constexpr double kLongestFix = 0.1;    ///< Newton's first correction of a predicted angle, rad
constexpr double kFirstGuess = 0.5;    ///< Newton's first correction of untwisted tubes, rad
constexpr double kUnexplained = 0.01;  ///< difference of a step to the derivatives at its ends, rad
constexpr double kLeastMove = 1e-4;    ///< a branch ends if it cannot be followed this far, rad
constexpr int kMaxSteps = 400;         ///< along a path
constexpr double kNudge = 1e-2;        ///< away from an equilibrium that ends, rad
constexpr int kMaxFalls = 8;

}  // namespace

TubeVector Equilibrium::Root::change(const safety::ArmVector& dq) const {
  const Eigen::Index n = dq.size() / 2;
  return by_translation.leftCols(n) * dq.head(n) + by_rotation.leftCols(n) * dq.tail(n);
}

void Equilibrium::Root::linearise(const Sweep& sweep) {
  by_rotation = sweep.baseByEnd().inverse();
  by_translation = -by_rotation * sweep.baseByTranslation();
}

void Equilibrium::Root::remember(const JointsRef& q, Branch& branch) const {
  branch.known = true;
  branch.snapped = snapped;
  branch.snap_energy = snap_energy;
  branch.snap_distance = snap_distance;
  branch.q = q;
  branch.end_angle = theta;
  branch.by_translation = by_translation;
  branch.by_rotation = by_rotation;
  branch.load.setZero();
}

bool Equilibrium::correct(const Segmentation& parts,
                          const JointsRef& q,
                          double coupling,
                          double longest,
                          Root& root,
                          int& conjugate_points) const noexcept {
  constexpr int kMaxIterations = 12;
  const TubeJoints joints(q);
  double allowed = longest;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Sweep sweep(arm_, parts, joints.beta, root.theta, coupling, StepDepth::kAngles);
    root.linearise(sweep);
    const TubeVector correction = root.by_rotation * (joints.alpha - sweep.baseAngle());
    const double size = correction.cwiseAbs().maxCoeff();
    if (!(size <= allowed))  // also for NaN
      return false;
    root.theta += correction;
    conjugate_points = sweep.determinant().conjugatePoints();
    if (size < kConverged)
      return true;
    allowed = 0.5 * size;  // near a solution Newton's method converges much faster
  }
  return false;
}

ModelStatus Equilibrium::find(const JointsRef& q, const Branch& branch, Root& root) const noexcept {
  root = Root{};
  const bool known = branch.known && branch.q.size() == q.size();
  const bool found = known ? follow(q, branch, root) : startCold(q, root) || startAside(q, root);
  return found ? ModelStatus::kOk : ModelStatus::kNotConverged;
}

/// For a cold start that ends at a saddle, as opposed tubes do: starts at slightly different joints, then returns.
bool Equilibrium::startAside(const JointsRef& q, Root& root) const noexcept {
  const Eigen::Index n = q.size() / 2;
  for (const double turn : {0.05, -0.05, 0.2, -0.2}) {
    safety::ArmVector aside = q;
    for (Eigen::Index i = 1; i < n; ++i)
      aside[n + i] += turn * static_cast<double>(i);
    root = Root{};
    if (!startCold(aside, root))
      continue;
    Branch branch;
    root.remember(aside, branch);
    if (follow(q, branch, root)) {
      root.snapped = false;
      root.snap_energy = root.snap_distance = 0.0;
      return true;
    }
  }
  return false;
}

/// Increases the coupling by torsion from 0 to 1.
bool Equilibrium::startCold(const JointsRef& q, Root& root) const noexcept {
  Segmentation parts;
  segment(arm_, q, parts);
  const TubeVector untwisted = untwistedEnds(arm_, parts, q);
  int conjugate_points = 0;
  root.theta = untwisted;
  if (correct(parts, q, 1.0, kFirstGuess, root, conjugate_points) && conjugate_points == 0)
    return true;
  Root reached;
  reached.theta = untwisted;
  double coupling = 0.0, step = 0.25;
  while (coupling < 1.0) {
    const double next = std::min(1.0, coupling + step);
    root = reached;
    if (correct(parts, q, next, kLongestMove, root, conjugate_points) && conjugate_points == 0) {
      reached = root;
      coupling = next;
      step *= 2.0;
    } else if ((step *= 0.5) < 1e-3) {
      root = reached;
      return fall(q, kNudge * TubeVector(0.0, 1.0, 2.0, 3.0), root);
    }
  }
  return true;
}

bool Equilibrium::connected(const Root& from, const Root& to, const safety::ArmVector& dq) noexcept {
  const TubeVector mean = 0.5 * (from.change(dq) + to.change(dq));
  return (to.theta - from.theta - mean).cwiseAbs().maxCoeff() < kUnexplained;
}

/// Follows the straight path from branch.q to q.
bool Equilibrium::follow(const JointsRef& q, const Branch& branch, Root& root) const noexcept {
  const safety::ArmVector start = branch.q, displacement = q - branch.q;
  safety::ArmVector next;
  Segmentation parts;
  Root reached;
  reached.theta = branch.end_angle;
  reached.by_translation = branch.by_translation;
  reached.by_rotation = branch.by_rotation;
  double done = 0.0, step = 1.0;
  for (int steps = 0, falls = 0; steps < kMaxSteps; ++steps) {
    const TubeVector velocity = reached.change(displacement);
    const double fastest = velocity.cwiseAbs().maxCoeff();
    step = std::min({step, 1.0 - done, kLongestMove / std::max(fastest, 1e-9)});
    const bool last = done + step >= 1.0;
    next = last ? safety::ArmVector(q) : safety::ArmVector(start + (done + step) * displacement);
    segment(arm_, next, parts);
    root = reached;
    root.theta += step * velocity;
    int conjugate_points = 0;
    if (correct(parts, next, 1.0, kLongestFix, root, conjugate_points) && conjugate_points == 0 &&
        connected(reached, root, step * displacement)) {
      if (last)
        return true;
      reached = root;
      done += step;
      step *= 2.0;
      continue;
    }
    if (step * fastest > kLeastMove && step > 1e-6) {
      step *= 0.5;
      continue;
    }
    root = reached;
    if (++falls > kMaxFalls || !fall(next, kNudge / std::max(fastest, 1e-9) * velocity, root))
      return false;
    measureSnap(next, reached.theta, root);
    if (last)
      return true;
    reached = root;
    done += step;
    step = 1.0;
  }
  return false;
}

Eigen::Vector3d Equilibrium::toolTip(const JointsRef& q, const TubeVector& theta) const noexcept {
  Segmentation parts;
  segment(arm_, q, parts);
  const Sweep sweep(arm_, parts, TubeJoints(q).beta, theta, 1.0, StepDepth::kPose);
  return sweep.endPosition() +
         sweep.endRotation() * (Eigen::AngleAxisd(theta[0], Eigen::Vector3d::UnitZ()) * arm_.tool.translation());
}

/** Energy and tip displacement of a snap at q, from the angles `before`, where the branch ended, to root.theta. The
 * motors stand: the released energy is the difference of the elastic energies. The branch ends within kLeastMove of q,
 * so both are taken at the translations of q. */
void Equilibrium::measureSnap(const JointsRef& q, const TubeVector& before, Root& root) const noexcept {
  Segmentation parts;
  segment(arm_, q, parts);
  const TubeVector beta = TubeJoints(q).beta;
  root.snapped = true;
  root.snap_energy += tubeLoads(arm_, parts, beta, before).energy - tubeLoads(arm_, parts, beta, root.theta).energy;
  root.snap_distance += (toolTip(q, root.theta) - toolTip(q, before)).norm();
}

bool Equilibrium::fall(const JointsRef& q, const TubeVector& aside, Root& root) const noexcept {
  Segmentation parts;
  segment(arm_, q, parts);
  const TubeVector from = root.theta;
  // The branch of the finite elements ends a little later than the real one, so a small push may return to it.
  for (double push = 1.0; push < 40.0; push *= 3.0) {
    root.theta = from;
    int conjugate_points = 0;
    if (relax(arm_, parts, q, push * aside, root.theta) &&
        correct(parts, q, 1.0, kFirstGuess, root, conjugate_points) && conjugate_points == 0)
      return true;
  }
  return false;
}

}  // namespace tandem::kinematics
