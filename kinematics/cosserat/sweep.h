// SPDX-License-Identifier: Apache-2.0
/** @file Forward integration of a rod: equations (12) of Norouzi-Ghazbi et al. as an initial value problem, with
 * derivatives. */
#pragma once

#include "kinematics/cosserat/rod.h"

namespace tandem::kinematics::cosserat {

/** How finely a sweep integrates. */
struct Accuracy {
  double tolerance = 1e-11;  ///< error of one step, in units of the rod's length, rad, and relative for derivatives
  int fixed_steps = 0;       ///< that many equal steps a section instead, or shorter ones where conjugate points are
                             ///< counted, without a look at the error
};

/** Counts conjugate points along a rod: the directions in which its energy falls.
 *
 * The rod is cut at the steps of integration into pieces too short to buckle. With S_k the stiffness of all that lies
 * before node k, and T the transfer of (shift and turn, force and moment) over the piece behind it, the energy has as
 * many negative directions as the matrices D_k = S_k + T12^-1 T11 of all inner nodes have negative eigenvalues (block
 * elimination; Haynsworth's inertia formula), the end being held. */
class HeldIndex {
 public:
  using Columns = Eigen::Matrix<double, 9, 9>;
  /// The next node. Rows turn, moment, shift; columns moment and force in the clamp, turn of the clamp.
  void add(const Columns& columns);
  int count() const { return count_; }

 private:
  bool first_ = true;
  int count_ = 0;
  Columns before_;
};

/** What a sweep starts from. */
struct SweepStart {
  const Rod& rod;
  const RodInput& input;
  Eigen::Vector3d base_moment = Eigen::Vector3d::Zero();  ///< m at the clamp, N m, robot base frame
  double load = 1.0;                                      ///< factor of all that acts on the rod from outside
  Accuracy accuracy = {};
  HeldIndex* index = nullptr;               ///< for sweeps with all columns
  std::vector<RodPoint>* points = nullptr;  ///< filled from their `s`, ascending, m
};

/// Columns of a sweep's derivatives, in this order: m at the clamp; force at the tip; turn of the clamp; inputs.
inline constexpr int kByMoment = 0, kByForce = 3, kByTurn = 6, kByInput = 9;
inline constexpr int kMomentColumns = 3, kWrenchColumns = 6, kAllColumns = 9 + kMaxActuators;

/** Where a sweep comes to; robot base frame, SI. */
template <int kColumns>
struct SweepEnd {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();     ///< of the rod's end
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();           ///< m there, N m
  double energy = 0.0;                                        ///< J
  Eigen::Matrix<double, 3, kColumns> turn, by_moment, shift;  ///< derivatives of rotation, m, position
  Eigen::Vector3d base_force = Eigen::Vector3d::Zero();       ///< n at the clamp, N
  Vector6 base_strain = Vector6::Zero();  ///< twist of the rod's frame there per metre: (R nu, R kappa)
  int steps = 0;
};

/** Integrates p' = R v, R' = R [u]x, m' = -p' x n - l, n known from what acts further on, and the variational equations
 * (Fehlberg 7(8); R and m in the robot base frame). kColumns is one of the three numbers above.
 * @return false where strains or steps come to nothing: loads beyond all measure */
template <int kColumns>
bool sweep(const SweepStart& start, SweepEnd<kColumns>& end) noexcept;

extern template bool sweep<kMomentColumns>(const SweepStart&, SweepEnd<kMomentColumns>&) noexcept;
extern template bool sweep<kWrenchColumns>(const SweepStart&, SweepEnd<kWrenchColumns>&) noexcept;
extern template bool sweep<kAllColumns>(const SweepStart&, SweepEnd<kAllColumns>&) noexcept;

/// Length of a rod in front of its clamp, m, and the moment that bends it by about one radian, N m: units in which
/// residuals are judged.
double lengthOf(const Rod& rod, const RodInput& input);
double momentScale(const Rod& rod, const RodInput& input);

}  // namespace tandem::kinematics::cosserat
