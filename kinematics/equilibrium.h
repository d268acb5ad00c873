// SPDX-License-Identifier: Apache-2.0
/** @file Boundary value problem of the unloaded arm: from joints to the angles of the tubes' ends. */
#pragma once

#include "kinematics/end_angle_sweep.h"

namespace tandem::kinematics {

/** Finds equilibria of an unloaded arm: theta with alpha(theta, beta) = alpha, by Newton's method on EndAngleSweep with
 * its exact derivatives.
 *
 * A warm start follows the branch along the straight joint path from the last result, with a prediction by d theta /
 * dq, in steps that are halved until Newton's corrections are small and the path stays stable. If the branch ends,
 * relax() computes the equilibrium that the arm snaps to, and the result has `snapped`, the released energy and the
 * way of the tip. A cold start switches torsion
 * on: first the tubes do not twist, theta = untwistedEnds(), then their torsional stiffness falls to the real one along
 * the same kind of path. All iterations are bounded and nothing allocates. */
class Equilibrium {
 public:
  using Sweep = EndAngleSweep<double>;

  /// A solution of the boundary value problem.
  struct Root {
    TubeVector theta = TubeVector::Zero();
    TubeMatrix by_translation = TubeMatrix::Zero();   ///< d theta / d beta
    TubeMatrix by_rotation = TubeMatrix::Identity();  ///< d theta / d alpha
    bool snapped = false;                             ///< the followed branch ended before this solution
    double snap_energy = 0.0, snap_distance = 0.0;    ///< as in Branch

    /// First-order change of theta for a change of the joints.
    TubeVector change(const safety::ArmVector& dq) const;
    /// Sets the derivatives from a sweep at theta.
    void linearise(const Sweep& sweep);
    /// Stores the solution in `branch` for the next call.
    void remember(const JointsRef& q, Branch& branch) const;
  };

  explicit Equilibrium(const ConcentricTubeArm& arm) : arm_(arm) {}

  /// Stable equilibrium at q on the given branch, theta within 1e-9 rad; checkJoints() has to be kOk for q.
  /// @return kOk or kNotConverged.
  ModelStatus find(const JointsRef& q, const Branch& branch, Root& root) const noexcept;

  /// Newton's method from root.theta at fixed joints.
  /// @param coupling see EndAngleSweep
  /// @param longest largest permitted first correction, rad
  /// @param conjugate_points of the solution
  /// @return true if it converged; root is undefined otherwise.
  bool correct(const Segmentation& parts,
               const JointsRef& q,
               double coupling,
               double longest,
               Root& root,
               int& conjugate_points) const noexcept;

  /// The derivatives at both ends of a step along a path agree with the step; otherwise Newton's method may have jumped
  /// to another branch.
  static bool connected(const Root& from, const Root& to, const safety::ArmVector& dq) noexcept;

 private:
  bool startCold(const JointsRef& q, Root& root) const noexcept;
  bool startAside(const JointsRef& q, Root& root) const noexcept;
  bool follow(const JointsRef& q, const Branch& branch, Root& root) const noexcept;
  bool fall(const JointsRef& q, const TubeVector& aside, Root& root) const noexcept;
  Eigen::Vector3d toolTip(const JointsRef& q, const TubeVector& theta) const noexcept;
  void measureSnap(const JointsRef& q, const TubeVector& before, Root& root) const noexcept;

  const ConcentricTubeArm& arm_;
};

}  // namespace tandem::kinematics
