// SPDX-License-Identifier: Apache-2.0
/** @file The boundary value problem of one Cosserat rod: clamped at one end, loaded along it and at its tip. */
#pragma once

#include "kinematics/cosserat/shot.h"

namespace tandem::kinematics::cosserat {

/** Algorithm 2 of Norouzi-Ghazbi et al., solved for certain: shooting from the clamp with Newton's method.
 *
 * Loads keep their direction, so the internal force is known along the rod and the moment at the clamp is all that is
 * unknown. A warm start begins at the last answer's; a cold one, or a warm one that does not converge, lets the load
 * grow from nothing, where the answer is known. Which equilibrium is meant, where there are several, is therefore the
 * one followed, or the one that grows out of the unloaded rod; it may be unstable, see RodAnswer::conjugate_points.
 * solve() allocates nothing and throws nothing; a model may serve many threads. */
class RodModel {
 public:
  /// @throw std::invalid_argument as checkRod() does.
  explicit RodModel(Rod rod, Accuracy accuracy = {});
  const Rod& rod() const { return rod_; }

  /// The equilibrium with all its derivatives; `branch` and `answer` are untouched unless kOk is returned.
  ModelStatus solve(const RodInput& input, RodBranch& branch, RodAnswer& answer) const noexcept;

  /// `points` cross-sections, evenly spaced from the clamp to the rod's end.
  ModelStatus shape(const RodInput& input, RodBranch& branch, int points, std::vector<RodPoint>& shape) const;

  /// Whether inputs can be answered.
  ModelStatus check(const RodInput& input) const noexcept;

 private:
  ModelStatus find(const RodInput& input, const RodBranch& branch, Eigen::Vector3d& moment) const noexcept;
  bool correct(const RodInput& input, double load, Eigen::Vector3d& moment) const noexcept;
  bool follow(const RodInput& input, Eigen::Vector3d& moment) const noexcept;
  bool polish(const SweepStart& from, Shot<kAllColumns>& shot, Eigen::Vector3d& moment) const noexcept;

  Rod rod_;
  Accuracy accuracy_;
};

}  // namespace tandem::kinematics::cosserat
