// SPDX-License-Identifier: Apache-2.0
/** @file The boundary value problem of the loaded arm: from joints and a wrench to the angles of the tubes' ends. */
#pragma once

#include "kinematics/equilibrium.h"
#include "kinematics/loaded_sweep.h"

namespace tandem::kinematics {

/** Finds equilibria under a wrench at the tool's tip that keeps its direction in the arm's base frame.
 *
 * Unknowns are the angles of the tubes' ends and how tube 1's end is turned; conditions are the motors' angles and the
 * base frame (Newton's method on LoadedSweep). Joints and wrench go together along the straight path from the last
 * answer, or, cold, from no wrench at the unloaded equilibrium, in steps that are halved as Equilibrium does.
 *
 * Where that path ends (a fold) or loses its stability (a column that buckles), the arm is looked for by a detour, on
 * which a small wrench aside tells it where to go and is then taken away; and if that ends too, along the curve of
 * equilibria around the fold, by its arc length, until it comes to the joints and the wrench asked for. The Branch
 * tells that it snapped. What is found in this way may be unstable, and is then answered with its conjugate points: no
 * stable equilibrium is known. */
class LoadedEquilibrium {
 public:
  /// A solution of the boundary value problem; wrenches in the arm base frame.
  struct Root {
    LoadedGuess guess;
    Eigen::Matrix<double, kLoadedUnknowns, kMaxTubes> by_translation, by_rotation;  ///< of the unknowns
    Eigen::Matrix<double, kLoadedUnknowns, 6> by_wrench;
    int conjugate_points = 0;
    bool snapped = false;

    /// Takes the derivatives from a sweep at the guess, by the implicit function theorem.
    void linearise(const LoadedSweep& sweep);
    /// Change of the unknowns to first order.
    LoadedVector change(const safety::ArmVector& dq, const Wrench& load) const;
    void move(const LoadedVector& change);
  };

  LoadedEquilibrium(const ConcentricTubeArm& arm, const Equilibrium& unloaded) : arm_(arm), unloaded_(unloaded) {}

  /// An equilibrium at q, for which checkJoints() has to be kOk. @return kOk or kNotConverged.
  /// @param wrench  arm base frame
  ModelStatus find(const JointsRef& q, const Wrench& wrench, const Branch& branch, Root& root) const noexcept;

 private:
  /// Where a path begins or ends.
  struct Place {
    safety::ArmVector q;
    Wrench wrench;
  };
  bool start(const JointsRef& q, const Branch& branch, Place& place, Root& root) const noexcept;
  bool correct(const Place& place, double longest, Root& root) const noexcept;
  double follow(const Place& from, const Place& to, Root& root) const noexcept;
  bool detour(const Place& from, const Place& to, double part, Root& root) const noexcept;
  bool untwisted(const Place& to, double part, Root& root) const noexcept;
  bool followAroundFold(const Place& from, const Place& to, double done, Root& root) const noexcept;

  const ConcentricTubeArm& arm_;
  const Equilibrium& unloaded_;
};

}  // namespace tandem::kinematics
