// SPDX-License-Identifier: Apache-2.0
/** @file Backward integration of a loaded arm from the tubes' ends to the motors: an initial value problem. */
#pragma once

#include "kinematics/determinant_track.h"
#include "kinematics/segmentation.h"

namespace tandem::kinematics {

/// Unknowns of a loaded arm: end angles of four tubes, then a rotation of the end frame (arm base frame, rad).
inline constexpr int kLoadedUnknowns = kMaxTubes + 3;
using LoadedVector = Eigen::Matrix<double, kLoadedUnknowns, 1>;
using LoadedSquare = Eigen::Matrix<double, kLoadedUnknowns, kLoadedUnknowns>;

/** Unknowns of the boundary value problem: state of a loaded arm at its end, without the wrench. */
struct LoadedGuess {
  TubeVector theta = TubeVector::Zero();              ///< angles of the tubes' ends in `end`, rad
  Eigen::Matrix3d end = Eigen::Matrix3d::Identity();  ///< arm base frame <- torsion-free frame of tube 1's end
};

/** Special Cosserat rods without shear and extension (Rucker, Jones and Webster 2010), integrated from a guess of the
 * state at the arm's end.
 *
 * All quantities are in the frame of tube 1's end (R, p: frame at s in it; f, m: wrench at its origin, constant there).
 * With sigma running backwards from the end:
 *
 *   psi_i' = -t_i / c_i,  t_i' = -b_i (u_x cos psi_i + u_y sin psi_i),  R' = -R [u]x,  p' = -R e_z,
 *   u = ((R' (m - p x f))_xy + sum_j b_j (-sin psi_j, cos psi_j)) / K,
 *
 * t_1 = m_z at the end of tube 1 and t_i = 0 at the other ends. The variational equations are integrated with them, so
 * derivatives by end angles, wrench and translations are exact (Fehlberg 7(8), step by error control).
 *
 * Stability is tested for the whole rod along the whole length (DeterminantTrack): Z(s) maps a variation of the end to
 * the one at s. A variation is the rotation of each tube about the backbone, delta psi_i + w_z, and the tilt of the
 * backbone, w_x and w_y, in the frame at s. Behind the entry point the backbone is guided and only angles remain. A
 * moment of constant direction has no potential; zeros of det Z then still mark where the equilibrium ends or
 * bifurcates.
 */
class LoadedSweep {
 public:
  using Twists = Eigen::Matrix<double, 6, kMaxTubes>;

  /// @param wrench force and moment at the tool's tip, arm base frame
  /// @param tool end frame of tube 1 <- tool's tip: position, m
  /// @param refine search the determinant's minimum between the steps of integration, too
  /// @param samples filled from their `s` (ascending, m) if given; poses are then in the frame of tube 1's end
  LoadedSweep(const ConcentricTubeArm& arm,
              const Segmentation& parts,
              const TubeVector& beta,
              const LoadedGuess& guess,
              const Wrench& wrench,
              bool refine,
              std::vector<ShapePoint>* samples = nullptr);

  /// Base angles for the guess, rad, and rotation of the resulting base frame relative to the real one.
  const TubeVector& baseAngle() const { return base_angle_; }
  const Eigen::Vector3d& baseTurn() const { return base_turn_; }
  /// Derivatives of (base angle, base turn) by the unknowns; the determinant is that of the whole arm, motors included.
  const LoadedSquare& byUnknowns() const { return by_unknowns_; }
  /// The same by the wrench at the tool's tip (arm base frame), and by the translations.
  const Eigen::Matrix<double, kLoadedUnknowns, 6>& byWrench() const { return by_wrench_; }
  const Eigen::Matrix<double, kLoadedUnknowns, kMaxTubes>& byTranslation() const { return by_translation_; }

  /// Tool's tip in the arm's base frame, m.
  Eigen::Vector3d tip() const { return tip_; }
  /// Twist of the tool (linear at its tip, then angular; arm base frame) by unknowns, wrench and translations.
  const Eigen::Matrix<double, 6, kLoadedUnknowns>& tipByUnknowns() const { return tip_by_unknowns_; }
  const Eigen::Matrix<double, 6, 6>& tipByWrench() const { return tip_by_wrench_; }
  const Twists& tipByTranslation() const { return tip_by_translation_; }
  /// Position of tube 1's end in the arm's base frame, m.
  Eigen::Vector3d endPosition() const { return end_position_; }

  /// Dimensions of a variation: angles of the tubes, tilt of the backbone.
  static constexpr int kVariation = kMaxTubes + 2;
  using Track = DeterminantTrack<double, kVariation>;
  const Track& determinant() const { return track_; }

  /// Columns of derivatives: by end angles, force, moment (both in the end frame), translations, and by the torsional
  /// and bending moments at the beginning of the present step.
  static constexpr int kForce = kMaxTubes, kMoment = kForce + 3, kTranslation = kMoment + 3;
  static constexpr int kStep = kTranslation + kMaxTubes, kColumns = kStep + kVariation;
  static constexpr int kRows = 2 * kMaxTubes + 6;   ///< of a column: psi, t, turn, shift
  static constexpr int kBase = 2 * kMaxTubes + 12;  ///< psi, t, R, p
  using State = Eigen::Matrix<double, kBase + kRows * kColumns, 1>;

 private:
  struct Interval {
    std::array<bool, kMaxTubes> present{};
    TubeVector b = TubeVector::Zero();           ///< K_i kappa_i, N m
    TubeVector compliance = TubeVector::Zero();  ///< 1 / c_i, 0 for tubes that have ended
    double total = 0.0;                          ///< K, N m^2
  };
  using Variation = Track::Square;
  Interval properties(int index) const;
  Eigen::Vector2d bend(const Interval& part, const State& y) const;
  TubeVector torque(const Interval& part, const State& y) const;
  void derivative(const Interval& part, const State& y, State& slope) const;
  void enter(const Interval& part, const Interval* distal, int owner);
  void cross(const Interval& part, double start, double end);
  void startStep(const Interval& part);
  State advanced(const Interval& part, const State& from, double length) const;
  void sample(const Interval& part, ShapePoint& point) const;

  using ByVariation = Eigen::Matrix<double, kMaxTubes + 3, kVariation>;
  ByVariation byVariation(const State& y, int row) const;
  Track::Place place(const Interval& part, const State& y, double length) const;
  void track(const Interval& part, const State& before, double length);
  void count(const Variation& form);

  void transmission();
  TubeVector trackTransmission(const Interval& entry);  ///< @return the transmission's compliance, rad / (N m)
  void finish();

  const ConcentricTubeArm& arm_;
  const Segmentation& parts_;
  TubeVector beta_;
  LoadedGuess guess_;
  Eigen::Vector3d force_, moment_;  ///< at the end of tube 1, in its frame
  Eigen::Vector3d tool_;            ///< from the end of tube 1 to the tool's tip, in its frame
  /// Force and moment in the end frame by the unknowns and by the wrench.
  Eigen::Matrix<double, 6, kLoadedUnknowns> load_by_unknowns_;
  Eigen::Matrix<double, 6, 6> load_by_wrench_;
  Eigen::Matrix<double, 6, kVariation> load_by_variation_;
  bool has_potential_;
  bool refine_;
  std::vector<ShapePoint>* samples_;
  std::size_t unsampled_ = 0;
  double s_;
  State y_;
  /// Derivative of the moment in the end frame by each column.
  Eigen::Matrix<double, 3, kColumns> moment_by_column_;

  TubeVector base_angle_;
  Eigen::Vector3d base_turn_;
  LoadedSquare by_unknowns_;
  Eigen::Matrix<double, kLoadedUnknowns, 6> by_wrench_;
  Eigen::Matrix<double, kLoadedUnknowns, kMaxTubes> by_translation_;
  Eigen::Vector3d tip_, end_position_;
  Eigen::Matrix<double, 6, kLoadedUnknowns> tip_by_unknowns_;
  Eigen::Matrix<double, 6, 6> tip_by_wrench_;
  Twists tip_by_translation_;
  Track track_;
};

}  // namespace tandem::kinematics
