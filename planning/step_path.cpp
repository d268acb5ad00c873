// SPDX-License-Identifier: Apache-2.0
#include "planning/detail/step_path.h"

#include <algorithm>
#include <cmath>

#include "control/obstructing_limits.h"
#include "planning/reference_tracker.h"

namespace tandem::planning {
namespace {

std::vector<const safety::ArmLimits*> pointersTo(const std::vector<safety::ArmLimits>& limits) {
  std::vector<const safety::ArmLimits*> pointers;
  for (const safety::ArmLimits& arm : limits)
    pointers.push_back(&arm);
  return pointers;
}

}  // namespace

StepPath::StepPath(const Arms& arms, const TrajectorySpec& spec) : arms_(arms), spec_(spec.ofPositions()) {
  for (const safety::ArmLimits* limits : arms.limits) {
    limits_.push_back(*limits);
    for (safety::JointLimit& joint : limits_.back().joints)
      joint.velocity = joint.approach_acceleration = safety::kUnlimited;
    for (safety::LinearRow& row : limits_.back().rows)
      row.approach_acceleration = safety::kUnlimited;
  }
}

std::optional<safety::RobotVector> StepPath::go(const TrajectoryPoint& from,
                                                const TrajectoryPoint& to,
                                                const safety::RobotVector& q,
                                                double accept,
                                                const std::function<bool()>& cancelled) const {
  constexpr double kPiece = 1e-3, kClose = 1e-3;  // m, of the tips
  safety::RobotVector joints = q;
  const double distance = std::max((to.tip - from.tip).norm(), (to.relative - from.relative).norm());
  const int pieces = std::max(1, static_cast<int>(std::ceil(distance / kPiece)));
  for (int piece = 1; piece <= pieces; ++piece) {
    const double share = static_cast<double>(piece) / pieces;
    const TrajectoryPoint here = between(spec_, from, to, share);
    const bool last = piece == pieces;
    const double error = approach(here, last ? accept : std::max(accept, 0.2 * kPiece), last, joints, cancelled);
    if (last && error > kClose)
      return std::nullopt;
  }
  return joints;
}

std::pair<double, double> StepPath::errorsOf(const TrackResult& result) const {
  return spec_.hasRelative() ? std::pair{result.error[0], result.error[1]} : std::pair{0.0, result.error[0]};
}

StepPath::End StepPath::converge(const TrajectoryPoint& point,
                                 const safety::RobotVector& q,
                                 const std::function<bool()>& cancelled) const {
  End end;
  end.q = q;
  end.error = approach(point, 0.0, true, end.q, cancelled);
  const control::MethodParameters parameters;
  ReferenceTracker tracker(arms_.models, pointersTo(limits_), control::Method::kNspqp, parameters, {});
  TrackResult result;
  tracker.step(end.q, end.q, referenceTo(spec_, point), result);
  if (result.status != TrackStatus::kOk)
    return end;
  end.limits = control::obstructingLimits(tracker.problem(), parameters, {}, false);
  return end;
}

double StepPath::approach(const TrajectoryPoint& point,
                          double accept,
                          bool finely,
                          safety::RobotVector& joints,
                          const std::function<bool()>& cancelled) const {
  constexpr int kMostWithoutGain = 60, kMost = 600;                 // steps
  constexpr double kProgress = 0.95, kFirst = 100.0, kKept = 1e-5;  // m
  const std::vector<const safety::ArmLimits*> limits = pointersTo(limits_);
  const Reference reference = referenceTo(spec_, point);
  TrackResult result;
  double least = safety::kUnlimited;
  safety::RobotVector nearest = joints;
  // Shorter steps end the oscillation across a kink of the Jacobian.
  for (const double size : {1.0, 0.1, 0.01, 0.001}) {
    control::MethodParameters parameters;
    parameters.translation_step *= size;
    parameters.rotation_velocity *= size;
    ReferenceTracker tracker(arms_.models, limits, control::Method::kNspqp, parameters, {});
    double best = safety::kUnlimited;
    for (int i = 0, since = 0; i < kMost && since < kMostWithoutGain; ++i, ++since) {
      if (cancelled && cancelled())
        return safety::kUnlimited;
      tracker.step(joints, joints, reference, result);
      if (result.status != TrackStatus::kOk)
        return safety::kUnlimited;
      const auto [relative_error, tip_error] = errorsOf(result);
      if (const double error = std::max(relative_error, tip_error); error <= accept)
        return error;
      // The relative position has precedence.
      const double score = tip_error + kFirst * std::max(0.0, relative_error - kKept);
      if (score < least) {
        least = score;
        nearest = joints;
      }
      if (score < kProgress * best) {
        best = score;
        since = 0;
      }
      joints += parameters.period * result.solution.velocity;
    }
    joints = nearest;
    if (!finely)
      break;
  }
  return least;
}

}  // namespace tandem::planning
