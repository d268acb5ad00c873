// SPDX-License-Identifier: Apache-2.0
/** @file Backward integration of a loaded arm from the tubes' ends to the motors: an initial value problem. */
#pragma once

#include "kinematics/determinant_track.h"
#include "kinematics/loaded_series.h"
#include "kinematics/segmentation.h"

namespace tandem::kinematics {

/// Unknowns of a loaded arm: end angles of four tubes, then a rotation of the end frame (arm base frame, rad).
inline constexpr int kLoadedUnknowns = kMaxTubes + 3;
template <int N>
class LoadedColumns;
using LoadedVector = Eigen::Matrix<double, kLoadedUnknowns, 1>;
using LoadedSquare = Eigen::Matrix<double, kLoadedUnknowns, kLoadedUnknowns>;

/** Unknowns of the boundary value problem: state of a loaded arm at its end, without the wrench. */
struct LoadedGuess {
  TubeVector theta = TubeVector::Zero();              ///< angles of the tubes' ends in `end`, rad
  Eigen::Matrix3d end = Eigen::Matrix3d::Identity();  ///< arm base frame <- torsion-free frame of tube 1's end
};

/** Requested outputs of a sweep. */
enum class LoadedDepth {
  kUnknowns,  ///< residual and its derivatives by the unknowns, as exact as Newton's method needs far from a solution
  kDerivatives,  ///< also those by wrench and translations, and the tip
  kPath,         ///< exact; also the conjugate points
  kTip,          ///< also the determinant's minimum
};

/** Special Cosserat rods without shear and extension (Rucker, Jones and Webster 2010), integrated from a guess of the
 * state at the arm's end back to the entry point, by Taylor series (LoadedSeries).
 *
 * t_1 = m_z at the end of tube 1 and t_i = 0 at the other ends. The variational equations are integrated with the state
 * (LoadedColumns), so derivatives by end angles, wrench and translations are exact: for kUnknowns those of the unknowns
 * themselves, otherwise the transition matrix of each piece, which also gives its stiffness.
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
  /// @param samples filled from their `s` (ascending, m) if given; poses are then in the frame of tube 1's end
  LoadedSweep(const ConcentricTubeArm& arm,
              const Segmentation& parts,
              const TubeVector& beta,
              const LoadedGuess& guess,
              const Wrench& wrench,
              LoadedDepth depth,
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

  static constexpr int kRows = 2 * kMaxTubes + 11;  ///< of a column of derivatives, see loaded_pieces

 private:
  /// Columns of derivatives: by end angles, force, moment (both in the end frame), and translations.
  static constexpr int kForce = kMaxTubes, kMoment = kForce + 3, kTranslation = kMoment + 3;
  static constexpr int kColumns = kTranslation + kMaxTubes;
  template <int C>
  using Columns = Eigen::Matrix<double, kRows, C>;
  using Variations = Columns<kVariation>;
  using Variation = Track::Square;
  LoadedPart properties(int index) const;
  void setLoads(const Wrench& wrench);
  void enter(const LoadedPart& part, const LoadedPart* distal, int owner);
  void cross(const LoadedPart& part, const Segmentation::Interval& interval);
  template <int N>
  void takeUnknowns(const LoadedSeries& series, const LoadedPoint& end);
  template <int N>
  void takeAll(const LoadedSeries& series, const LoadedPoint& end);
  void sample(const LoadedSeries& series);

  Variations variations(const Eigen::Matrix3d& rotation) const;
  template <int N>
  void track(const LoadedSeries& series,
             const LoadedColumns<N>& basis,
             const Columns<N>& transition,
             const LoadedPoint& end,
             const Variations& start);
  void count(const Variation& form);

  void transmission();
  TubeVector trackTransmission(const LoadedPart& entry);  ///< @return the transmission's compliance, rad / (N m)
  void finish();

  const ConcentricTubeArm& arm_;
  const Segmentation& parts_;
  TubeVector beta_;
  LoadedGuess guess_;
  LoadedDepth depth_;
  Eigen::Vector3d tool_;  ///< from the end of tube 1 to the tool's tip, in its frame
  /// Force and moment in the end frame by the unknowns, by the wrench, and by a variation of the end.
  Eigen::Matrix<double, 6, kLoadedUnknowns> load_by_unknowns_;
  Eigen::Matrix<double, 6, 6> load_by_wrench_;
  Eigen::Matrix<double, 6, kVariation> load_by_variation_;
  bool has_potential_;
  std::vector<ShapePoint>* samples_;
  std::size_t unsampled_ = 0;

  double s_;  ///< present position, m
  LoadedState state_;
  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Identity();  ///< present frame in that of tube 1's end
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Columns<kColumns> columns_;
  /// For kUnknowns instead: by the end angles of the arm's own tubes, then by the rotation of the end frame.
  static constexpr int kMostUnknowns = kLoadedUnknowns + 1;  // an even number
  Columns<kMostUnknowns> by_unknown_;

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
