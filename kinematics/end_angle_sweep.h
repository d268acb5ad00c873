// SPDX-License-Identifier: Apache-2.0
/** @file Backward integration of the unloaded arm from the tubes' ends to the motors: an initial value problem. */
#pragma once

#include <span>
#include <type_traits>

#include "kinematics/determinant_track.h"
#include "kinematics/segmentation.h"
#include "kinematics/taylor_step.h"

namespace tandem::kinematics {

/** Unloaded, torsionally compliant tubes, given by the angles theta_i of their ends (Rucker et al. 2010, Dupont et al.
 * 2010).
 *
 * The torsional moment of a tube is zero at its end, so end angles and translations determine the solution: no boundary
 * value problem remains. The sweep integrates, from the end of tube 1 back to the entry point, angles psi_i, moments
 * t_i = c_i psi_i' and the backbone, then adds the twist of the straight transmission behind the entry point,
 *
 *   alpha_i = psi_i(0) - t_i(0) F_i,   F_i = integral of 1 / c_i over the tube's part behind the entry point,
 *
 * where nothing couples the tubes, because the backbone is guided straight there. psi_i is the direction in which tube
 * i bends: along a helical tube psi_i' = t_i / c_i + tau_i, and alpha_i is also less by the integral of tau_i over the
 * part behind the entry point, over the whole tube if its end is there. All derivatives are exact: within an
 * interval they follow from the variational equations; a boundary that moves with its tube adds the difference of the
 * values before and behind it. Matrices have four rows and columns; those of tubes that the arm does not have are those
 * of the identity.
 * @tparam Scalar double, or a number with derivatives. */
template <class Scalar>
class EndAngleSweep {
 public:
  using Vector = Eigen::Matrix<Scalar, kMaxTubes, 1>;
  using Square = Eigen::Matrix<Scalar, kMaxTubes, kMaxTubes>;
  using Twists = Eigen::Matrix<Scalar, 6, kMaxTubes>;

  /// @param coupling 1 for the real arm; 0: tubes do not twist (their torsional stiffness is divided by it)
  /// @param samples filled from their `s` (ascending, m) with kPose, if given; poses are then in the arm's base frame
  EndAngleSweep(const ConcentricTubeArm& arm,
                const Segmentation& parts,
                const Vector& beta,
                const Vector& end_angle,
                double coupling,
                StepDepth depth,
                std::span<ShapePoint> samples = {});

  const Vector& baseAngle() const { return base_angle_; }            ///< alpha_i, rad
  const Square& baseByEnd() const { return base_by_end_; }           ///< d alpha / d theta
  const Square& baseByTranslation() const { return base_by_beta_; }  ///< d alpha / d beta at fixed theta, rad/m
  const Vector& entryAngle() const { return psi_; }                  ///< psi_i(0), rad
  const Vector& entryMoment() const { return moment_; }              ///< t_i(0), N m; constant back to the motor
  /// Stability of the equilibrium; see DeterminantTrack.
  const DeterminantTrack<Scalar>& determinant() const { return track_; }

  /// Frame of tube 1's end in the arm's base frame, torsion-free (kPose only, as for the functions below).
  Eigen::Matrix<Scalar, 3, 3> endRotation() const { return rotation_.transpose(); }
  Eigen::Matrix<Scalar, 3, 1> endPosition() const { return -(rotation_.transpose() * position_); }
  /// Twist of that frame (linear at the base's origin, then angular; base frame) by theta at fixed beta.
  Twists twistByEnd() const { return inBase(by_end_); }
  /// The same by beta at fixed theta.
  Twists twistByTranslation() const { return inBase(by_beta_); }

 private:
  struct Interval {
    std::array<bool, kMaxTubes> present{};
    std::array<double, kMaxTubes> stiffness{};  ///< K_i
    std::array<double, kMaxTubes> torsion{};    ///< c_i
    std::array<double, kMaxTubes> b{};          ///< K_i kappa_i
    std::array<double, kMaxTubes> helix{};      ///< tau_i, rad/m
    bool helical = false;                       ///< a tau is not 0
    double total = 0.0;                         ///< K
    std::array<int, kMaxTubes> curved{};        ///< tubes with b != 0
    int curved_count = 0;
  };
  Interval properties(int index) const;
  Scalar boundary(int index) const;  ///< end of an interval, m
  Eigen::Matrix<Scalar, 3, 1> bend(const Interval& part) const;
  std::array<Scalar, kMaxTubes> torque(const Interval& part) const;
  void enter(const Interval& part, const Interval* distal, int owner);
  void cross(const Interval& part, Scalar length);
  void crossStraight(const Interval& part, const Scalar& length);
  template <int NC>
  void crossCurved(const Interval& part, Scalar length);
  template <int NC>
  void take(const Interval& part, const TaylorStep<NC, Scalar>& step);
  template <int NC>
  Eigen::Matrix<Scalar, 2 * NC, kMaxTubes> states(const Interval& part, const Square& psi, const Square& moment) const;
  void twistFreely(const Interval& part, const Scalar& length);
  template <class Interior, class Stiffness>
  void track(const Interval& part,
             const Scalar& length,
             const Square& z,
             const Square& moment,
             const Interior& interior,
             const Stiffness& stiffness);
  Square psiSlope(const Interval& part, const Scalar& length, const Square& moment) const;
  void transmission();
  template <class Place>
  void sample(const Interval& part, const Scalar& length, const Place& place);
  Twists inBase(const Twists& twists) const;

  const ConcentricTubeArm& arm_;
  int tubes_;
  const Segmentation& parts_;
  Vector beta_;
  double coupling_;
  StepDepth depth_;
  std::span<ShapePoint> samples_;
  std::size_t unsampled_ = 0;  ///< samples in front of the present position

  double s_;                         ///< present position, m
  Vector psi_, moment_;              ///< at s_, rad, N m
  Square psi_by_end_, psi_by_beta_;  ///< Z, and the derivative by the translations
  Square moment_by_end_, moment_by_beta_;
  Eigen::Matrix<Scalar, 3, 3> rotation_;  ///< present frame in that of tube 1's end
  Eigen::Matrix<Scalar, 3, 1> position_;
  Twists by_end_, by_beta_;  ///< of the present frame, in the frame of tube 1's end
  DeterminantTrack<Scalar> track_;
  Vector base_angle_;
  Square base_by_end_, base_by_beta_;
};

// Members are in end_angle_sweep_impl.h, for the sources that instantiate them.
extern template class EndAngleSweep<double>;

}  // namespace tandem::kinematics
