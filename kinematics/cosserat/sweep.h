// SPDX-License-Identifier: Apache-2.0
/** @file Forward integration of a rod: equations (12) of Norouzi-Ghazbi et al. as an initial value problem, with
 * derivatives. */
#pragma once

#include "kinematics/cosserat/rod.h"

namespace tandem::kinematics::cosserat {

/** Accuracy of the integration. */
struct Accuracy {
  double tolerance = 1e-11;  ///< error of one step, in units of the rod's length, rad, and relative for derivatives
  int fixed_steps = 0;  ///< > 0: that many equal steps per section without error control, or shorter steps if conjugate
                        ///< points are counted
};

/** Counts conjugate points along a rod: directions in which its energy decreases.
 *
 * The steps of integration cut the rod into pieces too short to buckle. Let S_k be the stiffness at node k of the rod
 * between clamp and node, and T the transfer matrix of (shift and turn, force and moment) over the piece after it. For
 * a held end the energy has as many negative directions as the matrices D_k = S_k + T12^-1 T11 of all inner nodes have
 * negative eigenvalues (block elimination; Haynsworth's inertia formula). */
class HeldIndex {
 public:
  using Columns = Eigen::Matrix<double, 9, 9>;
  /// Adds the next node. Rows turn, moment, shift; columns moment and force at the clamp, turn of the clamp.
  void add(const Columns& columns);
  int count() const { return count_; }

 private:
  bool first_ = true;
  int count_ = 0;
  Columns before_;
};

/** Start of a sweep. */
struct SweepStart {
  const Rod& rod;
  const RodInput& input;
  Eigen::Vector3d base_moment = Eigen::Vector3d::Zero();  ///< m at the clamp, N m, robot base frame
  double load = 1.0;                                      ///< factor of all external loads on the rod
  Accuracy accuracy = {};
  HeldIndex* index = nullptr;               ///< for sweeps with all columns
  std::vector<RodPoint>* points = nullptr;  ///< filled from their `s`, ascending, m
  double pull = 0.0;                        ///< of the input's wire, rad
};

/// Columns of a sweep's derivatives, in this order: m at the clamp; force at the tip; turn of the clamp; inputs.
inline constexpr int kByMoment = 0, kByForce = 3, kByTurn = 6, kByInput = 9;
inline constexpr int kMomentColumns = 3, kWrenchColumns = 6, kAllColumns = 9 + kMaxActuators;

/** Result of a sweep at the rod's end; robot base frame, SI. */
template <int kColumns>
struct SweepEnd {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();     ///< of the rod's end
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();           ///< m there, N m
  double energy = 0.0;                                        ///< J
  Eigen::Matrix<double, 3, kColumns> turn, by_moment, shift;  ///< derivatives of rotation, m, position
  double bend = 0.0;                                          ///< left side of the wire's condition without e pull, rad
  Eigen::Matrix<double, 1, kColumns> bend_by;                 ///< its derivatives
  Eigen::Vector3d base_force = Eigen::Vector3d::Zero();       ///< n at the clamp, N
  Vector6 base_strain = Vector6::Zero();  ///< twist of the rod's frame there per metre: (R nu, R kappa)
  int steps = 0;
};

/** Integrates p' = R v, R' = R [u]x, m' = -p' x n - l, with n known from the loads further along the rod, and the
 * variational equations (Fehlberg 7(8); R and m in the robot base frame). kColumns is one of the three numbers above.
 * @return false if strains or steps do not converge, as under excessive loads */
template <int kColumns>
bool sweep(const SweepStart& start, SweepEnd<kColumns>& end) noexcept;

extern template bool sweep<kMomentColumns>(const SweepStart&, SweepEnd<kMomentColumns>&) noexcept;
extern template bool sweep<kWrenchColumns>(const SweepStart&, SweepEnd<kWrenchColumns>&) noexcept;
extern template bool sweep<kAllColumns>(const SweepStart&, SweepEnd<kAllColumns>&) noexcept;

/// Length of a rod in front of its clamp, m, and the moment that bends it by about one radian, N m: units of residuals.
double lengthOf(const Rod& rod, const RodInput& input);
double momentScale(const Rod& rod, const RodInput& input);

}  // namespace tandem::kinematics::cosserat
