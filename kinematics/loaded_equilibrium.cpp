// SPDX-License-Identifier: Apache-2.0
#include "kinematics/loaded_equilibrium.h"

#include <algorithm>

#include "kinematics/detail/arc_length.h"
#include "kinematics/rotations.h"

namespace tandem::kinematics {
namespace {

constexpr double kLoadedNear = 3e-4;         ///< a correction below this leaves an error of its square, rad
constexpr double kLoadedLinear = 1e-7;       ///< a correction below this is applied to first order, rad
constexpr double kLoadedLongestMove = 0.5;   ///< of an unknown in one step along a path, rad
constexpr double kLoadedLongestFix = 0.2;    ///< Newton's first correction of a predicted unknown, rad
constexpr double kLoadedUnexplained = 0.03;  ///< difference of a step to the derivatives at its ends, rad
constexpr double kLoadedLeastMove = 1e-4;    ///< a path ends if it cannot be followed this far, rad
constexpr int kLoadedMaxSteps = 200;         ///< along a path

/// Difference of two guesses: angles, and rotation of the end frame.
LoadedVector difference(const LoadedGuess& from, const LoadedGuess& to) {
  LoadedVector result;
  result << to.theta - from.theta, logarithm(to.end * from.end.transpose());
  return result;
}

}  // namespace

LoadedSquare LoadedEquilibrium::Root::linearise(const LoadedSweep& sweep) {
  const LoadedSquare inverse = sweep.byUnknowns().inverse();
  by_rotation = inverse.leftCols<kMaxTubes>();
  by_translation = -inverse * sweep.byTranslation();
  by_wrench = -inverse * sweep.byWrench();
  conjugate_points = sweep.determinant().conjugatePoints();
  tip = sweep.tip();
  tip_by_translation = sweep.tipByUnknowns() * by_translation + sweep.tipByTranslation();
  tip_by_rotation = sweep.tipByUnknowns() * by_rotation;
  compliance = sweep.tipByUnknowns() * by_wrench + sweep.tipByWrench();
  stability = sweep.determinant().minimum();
  stability_at = sweep.determinant().at();
  return inverse;
}

LoadedVector LoadedEquilibrium::Root::change(const safety::ArmVector& dq, const Wrench& load) const {
  const Eigen::Index n = dq.size() / 2;
  return by_translation.leftCols(n) * dq.head(n) + by_rotation.leftCols(n) * dq.tail(n) + by_wrench * load;
}

void LoadedEquilibrium::Root::move(const LoadedVector& change) {
  guess.theta += change.head<kMaxTubes>();
  const Eigen::Vector3d turn = change.tail<3>();
  if (const double angle = turn.norm(); angle > 0.0)
    guess.end = Eigen::Quaterniond((Eigen::AngleAxisd(angle, turn / angle) * guess.end)).normalized();
}

/// Newton's method from root.guess. Only its last steps need all derivatives.
/// @param longest largest permitted first correction, rad
/// @param depth of the result
/// @param near the guess is expected to be within kLoadedLinear
bool LoadedEquilibrium::correct(const Place& place,
                                double longest,
                                LoadedDepth depth,
                                bool near,
                                Root& root) const noexcept {
  constexpr int kMaxIterations = 12;
  Segmentation parts;
  segment(arm_, place.q, parts);
  const TubeJoints joints(place.q);
  double allowed = longest;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const LoadedSweep sweep(arm_, parts, joints.beta, root.guess, place.wrench, near ? depth : LoadedDepth::kUnknowns);
    LoadedVector residual;
    residual << joints.alpha - sweep.baseAngle(), -sweep.baseTurn();
    LoadedVector correction;
    if (near)
      correction = root.linearise(sweep) * residual;
    else
      correction = sweep.byUnknowns().partialPivLu().solve(residual);
    const double size = correction.cwiseAbs().maxCoeff();
    if (!(size <= allowed))  // also for NaN
      return false;
    root.move(correction);
    if (near && size < kLoadedLinear) {
      root.tip += sweep.tipByUnknowns().topRows<3>() * correction;
      return true;
    }
    near = size < kLoadedNear;
    allowed = 0.5 * size;
  }
  return false;
}

/// Start of a path: the given branch, or, without one, the unloaded arm at q.
bool LoadedEquilibrium::start(const JointsRef& q, const Branch& branch, Place& place, Root& root) const noexcept {
  const bool known = branch.known && branch.q.size() == q.size();
  place.q = known ? branch.q : safety::ArmVector(q);
  place.wrench.setZero();
  if (known && !branch.load.isZero(0.0)) {
    place.wrench = branch.load;
    root.guess = {branch.end_angle, branch.end_frame};
    root.by_translation << branch.by_translation, branch.turn_by_translation;
    root.by_rotation << branch.by_rotation, branch.turn_by_rotation;
    root.by_wrench = branch.by_load;
    return true;
  }
  Equilibrium::Root unloaded;
  if (unloaded_.find(place.q, branch, unloaded) != ModelStatus::kOk)
    return false;
  Segmentation parts;
  segment(arm_, place.q, parts);
  const TubeVector beta = TubeJoints(place.q).beta;
  const EndAngleSweep<double> pose(arm_, parts, beta, unloaded.theta, 1.0, StepDepth::kPose);
  root.guess = {unloaded.theta, pose.endRotation()};
  root.snapped = unloaded.snapped;
  root.linearise(LoadedSweep(arm_, parts, beta, root.guess, place.wrench, LoadedDepth::kDerivatives));
  return true;
}

/// Follows the straight path through stable equilibria.
/// @return completed share of it, 1 for all; root is the equilibrium there.
double LoadedEquilibrium::follow(const Place& from, const Place& to, Root& root) const noexcept {
  const safety::ArmVector displacement = to.q - from.q;
  const Wrench load = to.wrench - from.wrench;
  Root reached = root;
  Place next;
  double done = 0.0, step = 1.0;
  for (int steps = 0; steps < kLoadedMaxSteps && done < 1.0; ++steps) {
    const LoadedVector velocity = reached.change(displacement, load);
    const double fastest = velocity.cwiseAbs().maxCoeff();
    step = std::min({step, 1.0 - done, kLoadedLongestMove / std::max(fastest, 1e-9)});
    const bool last = done + step >= 1.0;
    next.q = last ? to.q : safety::ArmVector(from.q + (done + step) * displacement);
    next.wrench = last ? to.wrench : Wrench(from.wrench + (done + step) * load);
    root = reached;
    root.move(step * velocity);
    const LoadedDepth depth = last ? LoadedDepth::kTip : LoadedDepth::kPath;
    const bool found = correct(next, kLoadedLongestFix, depth, step * fastest < kLoadedNear, root);
    const LoadedVector mean = 0.5 * step * (velocity + root.change(displacement, load));
    if (found && root.conjugate_points == 0 &&
        (difference(reached.guess, root.guess) - mean).cwiseAbs().maxCoeff() < kLoadedUnexplained) {
      reached = root;
      done = last ? 1.0 : done + step;
      step *= 2.0;
    } else if (step * fastest < kLoadedLeastMove || step < 1e-6) {
      break;
    } else {
      step *= 0.5;
    }
  }
  root = reached;
  return done;
}

/// Detour through a lateral wrench, a share of the force: a column that buckles has no preferred direction.
bool LoadedEquilibrium::detour(const Place& from, const Place& to, double part, Root& root) const noexcept {
  const double length = to.q[0] + arm_.tubes[0].length();
  const double force = to.wrench.head<3>().norm() + to.wrench.tail<3>().norm() / length;
  Place aside = to;
  aside.wrench.head<3>() += part * force * Eigen::Vector3d(0.8, 0.6, 0.0);
  return follow(from, aside, root) >= 1.0 && follow(aside, to, root) >= 1.0;
}

/// Detour through tubes rotated partly towards tube 1, where they interact less.
bool LoadedEquilibrium::untwisted(const Place& to, double part, Root& root) const noexcept {
  Place from = to, loaded = to;
  const Eigen::Index n = to.q.size() / 2;
  loaded.q.tail(n) = to.q[n] + (1.0 - part) * (to.q.tail(n).array() - to.q[n]);
  return start(loaded.q, Branch{}, from, root) && follow(from, loaded, root) >= 1.0 && follow(loaded, to, root) >= 1.0;
}

/// Follows the curve of equilibria from the position `done` of the path, where the path ends.
/// @return true if it reached the end of the path; root is the equilibrium there, stable if one of the passages is.
bool LoadedEquilibrium::followAroundFold(const Place& from, const Place& to, double done, Root& root) const noexcept {
  constexpr double kFarthest = 4.0;  // from the start, in lengths of the path: the curve may return from there
  const safety::ArmVector displacement = to.q - from.q;
  const Wrench load = to.wrench - from.wrench;
  const auto system = [&](const Root& point, double lambda, auto& matrix) {
    const safety::ArmVector q = from.q + lambda * displacement;
    Segmentation parts;
    segment(arm_, q, parts);
    const TubeJoints joints(q), moves(displacement);
    const LoadedSweep sweep(arm_, parts, joints.beta, point.guess, from.wrench + lambda * load, LoadedDepth::kPath);
    LoadedVector by_lambda = sweep.byTranslation() * moves.beta + sweep.byWrench() * load;
    by_lambda.head<kMaxTubes>() -= moves.alpha;
    matrix.template topRows<kLoadedUnknowns>() << sweep.byUnknowns(), by_lambda;
    LoadedVector residual;
    residual << sweep.baseAngle() - joints.alpha, sweep.baseTurn();
    return residual;
  };
  bool arrived = false;
  const auto visit = [&](const Root& before, double lambda, const Root& after, double next) {
    if ((lambda < 1.0) != (next < 1.0)) {
      Root candidate = std::abs(next - 1.0) < std::abs(lambda - 1.0) ? after : before;
      if (correct(to, kLoadedLongestMove, LoadedDepth::kTip, false, candidate)) {
        arrived = true;
        root = candidate;
        return candidate.conjugate_points > 0;
      }
    }
    return std::abs(next) < kFarthest;
  };
  followArc<kLoadedUnknowns>(Root(root), done, 1.0, ArcLimits{}, system, visit);
  return arrived;
}

ModelStatus LoadedEquilibrium::find(const JointsRef& q,
                                    const Wrench& wrench,
                                    const Branch& branch,
                                    Root& root) const noexcept {
  const bool cold = !branch.known || branch.q.size() != q.size();
  const Place to{q, wrench};
  Place from;
  Root begin;
  if (!start(q, branch, from, begin))
    return ModelStatus::kNotConverged;
  root = begin;
  const double done = follow(from, to, root);
  if (done >= 1.0)
    return ModelStatus::kOk;
  const Root end = root;
  const auto finish = [&] {
    root.snapped = begin.snapped || !cold;
    return ModelStatus::kOk;
  };
  for (const double part : {0.02, -0.02}) {
    root = begin;
    if (detour(from, to, part, root))
      return finish();
  }
  Root unstable = end;
  const bool round = followAroundFold(from, to, done, unstable);
  if (round && unstable.conjugate_points == 0) {
    root = unstable;
    return finish();
  }
  for (const double part : {0.5, 1.0, -0.5, 1.5, -1.0, 2.0}) {
    if (untwisted(to, part, root))
      return finish();
  }
  if (!cold && find(q, wrench, Branch{}, root) == ModelStatus::kOk)
    return finish();
  root = unstable;
  return round ? finish() : ModelStatus::kNotConverged;
}

}  // namespace tandem::kinematics
