// SPDX-License-Identifier: Apache-2.0
/** @file The boundary value problem of the unloaded arm: from joints to the angles of the tubes' ends. */
#pragma once

#include "kinematics/end_angle_sweep.h"

namespace tandem::kinematics {

/** Finds equilibria of an unloaded arm: theta with alpha(theta, beta) = alpha, by Newton's method on
 * EndAngleSweep with its exact derivatives.
 *
 * Warm, it follows the branch along the straight joint path from the last answer, predicting by d theta / dq, in steps
 * that are halved until Newton's corrections are small and nothing on the way loses stability. Where the branch ends,
 * relax() says where the arm falls to, and the Branch tells that it snapped. Cold, it switches torsion on: at first
 * tubes do not twist, theta = alpha, and their torsional stiffness then falls to the real one along the same kind of
 * path. Everything is bounded and nothing allocates. */
class Equilibrium {
 public:
  using Sweep = EndAngleSweep<double>;

  /// A solution of the boundary value problem.
  struct Root {
    TubeVector theta = TubeVector::Zero();
    TubeMatrix by_translation = TubeMatrix::Zero();   ///< d theta / d beta
    TubeMatrix by_rotation = TubeMatrix::Identity();  ///< d theta / d alpha
    bool snapped = false;                             ///< the branch that was followed ended on the way

    /// Change of theta to first order with the joints.
    TubeVector change(const safety::ArmVector& dq) const;
    /// Takes the derivatives from a sweep at theta.
    void linearise(const Sweep& sweep);
    /// Writes it down for the next call.
    void remember(const JointsRef& q, Branch& branch) const;
  };

  explicit Equilibrium(const ConcentricTubeArm& arm) : arm_(arm) {}

  /// The equilibrium at q, for which checkJoints() has to be kOk, on the branch given: stable, theta within 1e-9 rad.
  /// @return kOk or kNotConverged.
  ModelStatus find(const JointsRef& q, const Branch& branch, Root& root) const noexcept;

  /// Newton's method from root.theta at fixed joints.
  /// @param coupling see EndAngleSweep
  /// @param longest largest first correction taken, rad
  /// @param conjugate_points of what was found
  /// @return whether it converged; root is undefined otherwise.
  bool correct(const Segmentation& parts,
               const JointsRef& q,
               double coupling,
               double longest,
               Root& root,
               int& conjugate_points) const noexcept;

  /// Whether the derivatives at both ends of a step along a path explain it: Newton's method may have leapt to another
  /// branch.
  static bool connected(const Root& from, const Root& to, const safety::ArmVector& dq) noexcept;

 private:
  bool startCold(const JointsRef& q, Root& root) const noexcept;
  bool startAside(const JointsRef& q, Root& root) const noexcept;
  bool follow(const JointsRef& q, const Branch& branch, Root& root) const noexcept;
  bool fall(const JointsRef& q, const TubeVector& aside, Root& root) const noexcept;

  const ConcentricTubeArm& arm_;
};

}  // namespace tandem::kinematics
