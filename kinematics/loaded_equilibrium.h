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
 * answer, or, cold, from no wrench at the unloaded equilibrium, in steps that are halved as Equilibrium does. Where the
 * path ends, the arm is taken to have fallen to what a cold start finds, and the Branch tells that it snapped. */
class LoadedEquilibrium {
 public:
  LoadedEquilibrium(const ConcentricTubeArm& arm, const Equilibrium& unloaded) : arm_(arm), unloaded_(unloaded) {}

  /// The stable equilibrium at q, for which checkJoints() has to be kOk. @return kOk or kNotConverged.
  /// @param wrench  arm base frame
  ModelStatus find(const JointsRef& q,
                   const Wrench& wrench,
                   const Branch& branch,
                   LoadedGuess& guess,
                   bool& snapped) const noexcept;

 private:
  struct Place {
    safety::ArmVector q;
    Wrench wrench;
    LoadedGuess guess;
  };
  bool startUnloaded(const JointsRef& q, const Branch& branch, Place& place) const noexcept;
  bool follow(const Place& start, const JointsRef& q, const Wrench& wrench, LoadedGuess& guess) const noexcept;
  bool correct(const JointsRef& q, const Wrench& wrench, LoadedGuess& guess) const noexcept;

  const ConcentricTubeArm& arm_;
  const Equilibrium& unloaded_;
};

}  // namespace tandem::kinematics
