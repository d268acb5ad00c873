// SPDX-License-Identifier: Apache-2.0
/** @file Boundary value problem of the loaded arm: from joints and a wrench to the angles of the tubes' ends. */
#pragma once

#include "kinematics/equilibrium.h"
#include "kinematics/loaded_sweep.h"

namespace tandem::kinematics {

/** Finds equilibria under a wrench at the tool's tip with constant direction in the arm's base frame.
 *
 * Unknowns are the angles of the tubes' ends and the rotation of tube 1's end; conditions are the motors' angles and
 * the base frame (Newton's method on LoadedSweep; its last step, which needs all derivatives, is also the result's).
 * Joints and wrench change together along the straight path from the
 * last result, or, after a cold start, from the unloaded equilibrium at zero wrench, in steps that are halved as in
 * Equilibrium.
 *
 * If that path ends (a fold) or loses its stability (a column that buckles), the search takes a detour: a small lateral
 * wrench selects a direction and is then removed. If the detour ends too, the search follows the curve of equilibria
 * around the fold by arc length, until it reaches the requested joints and wrench. The Branch then has `snapped`. A
 * solution found in this way may be unstable; its conjugate points are then reported, and no stable equilibrium is
 * known. */
class LoadedEquilibrium {
 public:
  /// A solution of the boundary value problem; wrenches in the arm base frame.
  struct Root {
    LoadedGuess guess;
    Eigen::Matrix<double, kLoadedUnknowns, kMaxTubes> by_translation, by_rotation;  ///< of the unknowns
    Eigen::Matrix<double, kLoadedUnknowns, 6> by_wrench;
    int conjugate_points = 0;
    bool snapped = false;
    /// Tool's tip, m, and its twist by translations, rotations and wrench.
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();
    LoadedSweep::Twists tip_by_translation, tip_by_rotation;
    Eigen::Matrix<double, 6, 6> compliance;
    double stability = 1.0, stability_at = 0.0;  ///< for LoadedDepth::kTip

    /// Sets the derivatives from a sweep at the guess, of LoadedDepth::kPath or kTip, by the implicit function theorem.
    /// @return derivative of the unknowns by the conditions
    LoadedSquare linearise(const LoadedSweep& sweep);
    /// First-order change of the unknowns.
    LoadedVector change(const safety::ArmVector& dq, const Wrench& load) const;
    void move(const LoadedVector& change);
  };

  LoadedEquilibrium(const ConcentricTubeArm& arm, const Equilibrium& unloaded) : arm_(arm), unloaded_(unloaded) {}

  /// Equilibrium at q, for which checkJoints() has to be kOk. @return kOk or kNotConverged.
  /// @param wrench arm base frame
  ModelStatus find(const JointsRef& q, const Wrench& wrench, const Branch& branch, Root& root) const noexcept;

 private:
  /// Start or end of a path.
  struct Place {
    safety::ArmVector q;
    Wrench wrench;
  };
  bool start(const JointsRef& q, const Branch& branch, Place& place, Root& root) const noexcept;
  bool correct(const Place& place, double longest, LoadedDepth depth, bool near, Root& root) const noexcept;
  double follow(const Place& from, const Place& to, Root& root) const noexcept;
  bool detour(const Place& from, const Place& to, double part, Root& root) const noexcept;
  bool untwisted(const Place& to, double part, Root& root) const noexcept;
  bool followAroundFold(const Place& from, const Place& to, double done, Root& root) const noexcept;

  const ConcentricTubeArm& arm_;
  const Equilibrium& unloaded_;
};

}  // namespace tandem::kinematics
