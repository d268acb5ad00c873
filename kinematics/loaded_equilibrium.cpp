// SPDX-License-Identifier: Apache-2.0
#include "kinematics/loaded_equilibrium.h"

#include <algorithm>

namespace tandem::kinematics {
namespace {

constexpr double kConverged = 1e-5;  ///< a correction below this leaves an error of its square, rad
constexpr double kLongestFix = 0.3;  ///< Newton's first correction, rad
constexpr double kLeastStep = 1e-4;  ///< part of a path below which it counts as ended
constexpr int kMaxSteps = 200;

}  // namespace

bool LoadedEquilibrium::correct(const JointsRef& q, const Wrench& wrench, LoadedGuess& guess) const noexcept {
  constexpr int kMaxIterations = 12;
  Segmentation parts;
  segment(arm_, q, parts);
  const TubeJoints joints(q);
  double allowed = kLongestFix;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const LoadedSweep sweep(arm_, parts, joints.beta, guess, wrench);
    LoadedVector residual;
    residual << joints.alpha - sweep.baseAngle(), -sweep.baseTurn();
    const LoadedVector correction = sweep.byUnknowns().partialPivLu().solve(residual);
    const double size = correction.cwiseAbs().maxCoeff();
    if (!(size <= allowed))
      return false;
    guess.theta += correction.head<kMaxTubes>();
    const Eigen::Vector3d turn = correction.tail<3>();
    if (const double angle = turn.norm(); angle > 0.0)
      guess.end = Eigen::Quaterniond((Eigen::AngleAxisd(angle, turn / angle) * guess.end)).normalized();
    if (size < kConverged)
      return sweep.signChanges() == 0;
    allowed = 0.5 * size;
  }
  return false;
}

bool LoadedEquilibrium::startUnloaded(const JointsRef& q, const Branch& branch, Place& place) const noexcept {
  Equilibrium::Root root;
  if (unloaded_.find(q, branch, root) != ModelStatus::kOk)
    return false;
  Segmentation parts;
  segment(arm_, q, parts);
  const EndAngleSweep<double> sweep(arm_, parts, TubeJoints(q).beta, root.theta, 1.0, StepDepth::kPose);
  place.q = q;
  place.wrench.setZero();
  place.guess = {root.theta, sweep.endRotation()};
  return true;
}

bool LoadedEquilibrium::follow(const Place& start,
                               const JointsRef& q,
                               const Wrench& wrench,
                               LoadedGuess& guess) const noexcept {
  const safety::ArmVector way = q - start.q;
  const Wrench load = wrench - start.wrench;
  safety::ArmVector next;
  LoadedGuess reached = start.guess;
  double done = 0.0, step = 1.0;
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    step = std::min(step, 1.0 - done);
    const bool last = done + step >= 1.0;
    next = last ? safety::ArmVector(q) : safety::ArmVector(start.q + (done + step) * way);
    guess = reached;
    if (correct(next, last ? wrench : Wrench(start.wrench + (done + step) * load), guess)) {
      if (last)
        return true;
      reached = guess;
      done += step;
      step *= 2.0;
    } else if ((step *= 0.5) < kLeastStep) {
      return false;
    }
  }
  return false;
}

ModelStatus LoadedEquilibrium::find(const JointsRef& q,
                                    const Wrench& wrench,
                                    const Branch& branch,
                                    LoadedGuess& guess,
                                    bool& snapped) const noexcept {
  snapped = false;
  Place start;
  const bool known = branch.known && branch.q.size() == q.size();
  if (known && !branch.load.isZero(0.0)) {
    start = {branch.q, branch.load, {branch.end_angle, branch.end_frame}};
    if (follow(start, q, wrench, guess))
      return ModelStatus::kOk;
    snapped = true;
  } else if (known && startUnloaded(branch.q, branch, start)) {
    if (follow(start, q, wrench, guess))
      return ModelStatus::kOk;
    snapped = true;
  }
  if (!startUnloaded(q, Branch{}, start) || !follow(start, q, wrench, guess))
    return ModelStatus::kNotConverged;
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics
