// SPDX-License-Identifier: Apache-2.0
/** @file Boundary value problem of one Cosserat rod: clamped at one end, with loads along it and at its tip. */
#pragma once

#include "kinematics/cosserat/shot.h"

namespace tandem::kinematics::cosserat {

/** Algorithm 2 of Norouzi-Ghazbi et al. with safeguards: shooting from the clamp with Newton's method.
 *
 * Loads keep their direction, so the internal force along the rod is known and the only unknown is the moment at the
 * clamp, beside the pull of a wire whose displacement is given. A warm start begins at the last result's moment; a cold
 * one, or a warm one that does not converge, increases the load from zero, where the solution is known. If there are
 * several equilibria, the result is therefore the tracked one, or the one that develops from the unloaded rod; it may
 * be unstable, see RodAnswer::conjugate_points. solve() allocates nothing and throws nothing; several threads may use
 * one model. */
class RodModel {
 public:
  /// @throw std::invalid_argument as checkRod() does.
  explicit RodModel(Rod rod, Accuracy accuracy = {});
  const Rod& rod() const { return rod_; }

  /// Equilibrium with all its derivatives; `branch` and `answer` change only if kOk is returned.
  ModelStatus solve(const RodInput& input, RodBranch& branch, RodAnswer& answer) const noexcept;

  /// `points` cross-sections, evenly spaced from the clamp to the rod's end.
  ModelStatus shape(const RodInput& input, RodBranch& branch, int points, std::vector<RodPoint>& shape) const;

  /// kOk if the inputs are valid.
  ModelStatus check(const RodInput& input) const noexcept;

 private:
  /// Moment at the clamp, N m, robot base frame; pull of the wire, rad.
  using Unknowns = Eigen::Vector4d;
  ModelStatus find(const RodInput& input, const RodBranch& branch, Unknowns& x) const noexcept;
  template <int kColumns>
  bool correct(const RodInput& input, double load, Unknowns& x) const noexcept;
  bool correct(const RodInput& input, double load, Unknowns& x) const noexcept;
  bool follow(const RodInput& input, Unknowns& x) const noexcept;
  bool polish(const SweepStart& from, Shot<kAllColumns>& shot, Unknowns& x) const noexcept;

  Rod rod_;
  Accuracy accuracy_;
};

}  // namespace tandem::kinematics::cosserat
