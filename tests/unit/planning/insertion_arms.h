// SPDX-License-Identifier: Apache-2.0
/** @file Arms that advance along their own path. */
#pragma once

#include "planning/insertion.h"
#include "planning/leader_path.h"
#include "task_loop.h"

namespace tandem::test {

inline constexpr int kPoints = 12;
inline constexpr double kCurved = 0.05;  // m, of every tube at its end

/// Torsions of the tubes of a deployment: circles, helices of one torsion, or helices of one each.
enum class Helix { kNone, kCommon, kAny };

/** An arm of tubes that are curved over their last 50 mm, and an insertion: outer tubes first. */
struct Deployment {
  kinematics::ConcentricTubeArm arm;
  safety::ArmLimits limits;
  std::unique_ptr<kinematics::ArmModel> model;
  planning::Arms arms;
  safety::RobotVector q;
  planning::TrajectorySpec spec;

  /// Ends of all tubes 5 to 15 mm in front of the entry point, rotations at random or so that all bend alike there.
  Deployment(Random& random, const char* kind, bool planar, Helix helix = Helix::kNone) : arm(arkArm(0.0)) {
    const int n = random.integer(2, 3);
    arm.tubes.resize(static_cast<std::size_t>(n));
    arm.base.linear() = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
    arm.base.translation() = anyVector(random, 0.05);
    const double end = random.uniform(0.005, 0.015), turn = random.uniform(-3.0, 3.0);
    q.resize(2 * n);
    planning::Insertion insertion;
    const double common = helix == Helix::kCommon ? torsionFrom(random) : 0.0;
    for (int i = 0; i < n; ++i) {
      kinematics::TubeSection& bend = arm.tubes[static_cast<std::size_t>(i)].sections.back();
      bend.curvature = random.uniform(2.0, 12.0) * (random.chance(0.5) ? 1.0 : -1.0);
      q[i] = end - arm.tubes[static_cast<std::size_t>(i)].length();
      bend.helix_torsion = helix == Helix::kAny ? torsionFrom(random) : common;
      q[n + i] = planar ? turn : random.uniform(-3.0, 3.0);
      insertion.stages.push_back({n - i, random.uniform(0.002, (kCurved - end) / n)});
    }
    limits = limitsOf(arm);
    model = kinematics::makeArmModel(kind, arm);
    arms = {{model.get()}, {&limits}};
    spec.other_arm = planning::kNoArm;
    spec.shape = insertion;
    spec.point_count = kPoints;
  }
  static double torsionFrom(Random& random) { return random.uniform(8.0, 40.0) * (random.chance(0.5) ? 1.0 : -1.0); }
  int tubes() const { return arm.tubeCount(); }
  /// After a change of the arm.
  void remake(const char* kind) {
    model = kinematics::makeArmModel(kind, arm);
    arms.models = {model.get()};
  }
  planning::Insertion& insertion() { return std::get<planning::Insertion>(spec.shape); }
  /// The start and the points, one column each.
  Eigen::MatrixXd path() {
    planning::setInsertion(arms, q, spec);
    Eigen::MatrixXd path(q.size(), kPoints + 1);
    path.col(0) = q;
    for (int k = 0; k < kPoints; ++k)
      path.col(k + 1) = insertion().joints[static_cast<std::size_t>(k)];
    return path;
  }
  double deviation() { return planning::leaderDeviation(arms, 0, path()).distance; }
  double length(const Eigen::VectorXd& at) const { return at[0] + arm.tubes[0].length(); }
};

}  // namespace tandem::test
