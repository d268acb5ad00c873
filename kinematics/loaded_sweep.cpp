// SPDX-License-Identifier: Apache-2.0
#include "kinematics/loaded_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/detail/loaded_pieces.h"
#include "kinematics/detail/transmission.h"

namespace tandem::kinematics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
namespace rows = loaded_pieces;

constexpr int kMaxPieces = 1000;  ///< of one interval

}  // namespace

LoadedSweep::LoadedSweep(const ConcentricTubeArm& arm,
                         const Segmentation& parts,
                         const TubeVector& beta,
                         const LoadedGuess& guess,
                         const Wrench& wrench,
                         LoadedDepth depth,
                         std::vector<ShapePoint>* samples)
    : arm_(arm),
      parts_(parts),
      beta_(beta),
      guess_(guess),
      depth_(depth),
      has_potential_(wrench.tail<3>().isZero(0.0)),
      samples_(samples),
      unsampled_(samples ? samples->size() : 0),
      s_(parts.length()),
      track_(parts.length()) {
  setLoads(wrench);
  if (depth_ == LoadedDepth::kUnknowns) {
    by_unknown_.setZero();
    const auto begin = [&](int column, int unknown) {
      by_unknown_.middleRows<3>(rows::kForce).col(column) = load_by_unknowns_.col(unknown).head<3>();
      by_unknown_.middleRows<2>(rows::kMoment).col(column) = load_by_unknowns_.col(unknown).segment<2>(3);
      by_unknown_(rows::kTorsion, column) = load_by_unknowns_(5, unknown);
    };
    const int n = arm_.tubeCount();
    for (int i = 0; i < n; ++i) {
      begin(i, i);
      by_unknown_(i, i) = 1.0;
    }
    for (int i = 0; i < 3; ++i)
      begin(n + i, kMaxTubes + i);
  } else {
    columns_.setZero();
    columns_.topLeftCorner<kMaxTubes, kMaxTubes>().setIdentity();
    columns_.block<3, 3>(rows::kForce, kForce).setIdentity();
    columns_.block<2, 2>(rows::kMoment, kMoment).setIdentity();
    columns_(rows::kTorsion, kMoment + 2) = 1.0;
  }
  LoadedPart distal;
  for (int k = parts_.count - 1; k >= 0; --k) {
    const LoadedPart part = properties(k);
    if (depth_ != LoadedDepth::kUnknowns)
      enter(part, k + 1 == parts_.count ? nullptr : &distal, parts_.interval[k].owner);
    cross(part, parts_.interval[k]);
    distal = part;
  }
  base_turn_ = logarithm(guess_.end * rotation_);
  transmission();
  if (depth_ != LoadedDepth::kUnknowns)
    finish();
}

/// Force and moment at the end of tube 1, in its frame, and their derivatives.
void LoadedSweep::setLoads(const Wrench& wrench) {
  const Matrix3d& end = guess_.end;
  tool_ = Eigen::AngleAxisd(guess_.theta[0], Vector3d::UnitZ()) * Vector3d(arm_.tool.translation());
  state_.psi = guess_.theta;
  state_.force = end.transpose() * wrench.head<3>();
  const Vector3d moment = end.transpose() * wrench.tail<3>() + tool_.cross(state_.force);
  state_.moment = moment.head<2>();
  state_.torsion[0] = moment.z();
  // A rotation w of the end frame (base frame) changes end' F by end' (F x w).
  load_by_wrench_.setZero();
  load_by_wrench_.topLeftCorner<3, 3>() = end.transpose();
  load_by_wrench_.bottomRightCorner<3, 3>() = end.transpose();
  load_by_wrench_.bottomLeftCorner<3, 3>() = skew(tool_) * end.transpose();
  load_by_unknowns_.setZero();
  load_by_unknowns_.topRightCorner<3, 3>() = end.transpose() * skew(wrench.head<3>());
  load_by_unknowns_.bottomRightCorner<3, 3>() =
      end.transpose() * skew(wrench.tail<3>()) + skew(tool_) * load_by_unknowns_.topRightCorner<3, 3>();
  load_by_unknowns_.col(0).tail<3>() = Vector3d::UnitZ().cross(tool_).cross(state_.force);
  load_by_variation_ << load_by_unknowns_.leftCols<kMaxTubes>(), load_by_unknowns_.rightCols<3>() * end.leftCols<2>();
}

LoadedPart LoadedSweep::properties(int index) const {
  LoadedPart part;
  for (int i = 0; i < arm_.tubeCount(); ++i) {
    const int section = parts_.interval[index].section[i];
    part.present[i] = section != Segmentation::kAbsent;
    if (!part.present[i])
      continue;
    const TubeSection& properties = arm_.tubes[i].sections[section];
    part.b[i] = properties.bending_stiffness * properties.curvature;
    part.compliance[i] = 1.0 / properties.torsional_stiffness;
    part.helix[i] = properties.helix_torsion;
    part.total += properties.bending_stiffness;
    if (part.isCurved(i))
      part.curved[part.curved_count++] = i;
  }
  return part;
}

/// The boundary moves with its owner: a small part of `part` replaces `distal`.
void LoadedSweep::enter(const LoadedPart& part, const LoadedPart* distal, int owner) {
  auto column = columns_.col(kTranslation + owner);
  Vector2d bend = state_.bend(part);
  column.segment<kMaxTubes>(rows::kTorsion) -= state_.torque(part);
  column.head<kMaxTubes>() -= part.compliance.cwiseProduct(state_.torsion) + part.helix;
  const Vector3d& n = state_.force;
  if (distal) {
    bend -= state_.bend(*distal);
    column.segment<kMaxTubes>(rows::kTorsion) += state_.torque(*distal);
    column.head<kMaxTubes>() += distal->compliance.cwiseProduct(state_.torsion) + distal->helix;
  } else {
    column.segment<2>(rows::kMoment) += Vector2d(-n.y(), n.x());
    column[rows::kShift + 2] -= 1.0;
  }
  const Vector3d u(bend.x(), bend.y(), 0.0);
  column.segment<3>(rows::kTurn) -= u;
  column.segment<2>(rows::kMoment) += state_.torsion.sum() * Vector2d(u.y(), -u.x());
  column.segment<3>(rows::kForce) += u.cross(n);
}

void LoadedSweep::cross(const LoadedPart& part, const Segmentation::Interval& interval) {
  const auto& tolerance = depth_ < LoadedDepth::kPath ? LoadedSeries::kCoarse : LoadedSeries::kExact;
  double left = interval.end - interval.start;
  for (int pieces = 0; left > 0.0; ++pieces) {
    const LoadedSeries series(part, state_, left, tolerance);
    if (pieces > kMaxPieces) {  // excessive load: NaN, because there is no solution
      state_.psi.setConstant(std::numeric_limits<double>::quiet_NaN());
      rotation_.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    sample(series);
    const LoadedPoint end = series.at(1.0);
    if (depth_ == LoadedDepth::kUnknowns && arm_.tubeCount() < kMaxTubes)
      takeUnknowns<kMostUnknowns - 2>(series, end);
    else if (depth_ == LoadedDepth::kUnknowns)
      takeUnknowns<kMostUnknowns>(series, end);
    else if (part.curved_count == 0)
      takeAll<6>(series, end);
    else if (part.curved_count == 1)
      takeAll<8>(series, end);
    else if (part.curved_count == 2)
      takeAll<10>(series, end);
    else if (part.curved_count == 3)
      takeAll<12>(series, end);
    else
      takeAll<14>(series, end);
    left -= series.length();
    position_ += rotation_ * end.position;
    rotation_ *= end.rotation;
    state_ = end.state;
    s_ = interval.start + left;
  }
}

template <int N>
void LoadedSweep::takeUnknowns(const LoadedSeries& series, const LoadedPoint& end) {
  const Columns<N> start = by_unknown_.leftCols<N>();
  const LoadedColumns<N> columns(series, rows::givenStart<N>(series.part(), start), false);
  Columns<N> result = rows::endOf<N>(series.part(), columns.at(end));
  rows::addPassive(series, end, start, result);
  by_unknown_.leftCols<N>() = result;
}

template <int N>
void LoadedSweep::takeAll(const LoadedSeries& series, const LoadedPoint& end) {
  const LoadedColumns<N> basis(series, rows::unitStart<N>(series.part().curved_count), true);
  const Columns<N> transition = rows::endOf<N>(series.part(), basis.at(end));
  const Variations start = variations(rotation_);
  columns_ = rows::carried<N, kColumns>(series, transition, end, columns_);
  if (depth_ >= LoadedDepth::kPath)
    track(series, basis, transition, end, start);
}

/// Fills the samples of a piece that begins at the present position.
void LoadedSweep::sample(const LoadedSeries& series) {
  constexpr double kRounding = 1e-12;  // a sample at s = 0 is in the last piece, m
  const LoadedPart& part = series.part();
  for (; unsampled_ > 0 && (*samples_)[unsampled_ - 1].s >= s_ - series.length() - kRounding; --unsampled_) {
    ShapePoint& point = (*samples_)[unsampled_ - 1];
    const double x = std::clamp((s_ - point.s) / series.length(), 0.0, 1.0);
    const auto [at, state, rotation, position] = series.at(x);
    point.pose.linear() = rotation_ * rotation;
    point.pose.translation() = position_ + rotation_ * position;
    point.curvature = state.bend(part);
    point.psi.fill(std::numeric_limits<double>::quiet_NaN());
    point.moment.fill(std::numeric_limits<double>::quiet_NaN());
    point.outermost_tube = 0;
    for (int i = 0; i < kMaxTubes; ++i) {
      if (!part.present[i])
        continue;
      point.psi[i] = state.psi[i];
      point.moment[i] = state.torsion[i];
      point.outermost_tube = i + 1;
    }
  }
}

void LoadedSweep::transmission() {
  const LoadedPart entry = properties(0);
  TubeVector straightened = state_.psi;  // angles at the motors without twist
  for (int i = 0; i < arm_.tubeCount(); ++i)
    straightened[i] -= arm_.tubes[i].helixAngle(-beta_[i]);
  if (depth_ == LoadedDepth::kUnknowns) {
    const TubeVector compliance = crossTransmission<double>(arm_, parts_, beta_, [](const TubeVector&, double) {});
    base_angle_ = straightened - compliance.cwiseProduct(state_.torsion);
    by_unknowns_.setIdentity();
    const int n = arm_.tubeCount();
    for (int c = 0; c < n + 3; ++c) {
      const auto column = by_unknown_.col(c);
      const int unknown = c < n ? c : kMaxTubes + c - n;
      by_unknowns_.col(unknown).head<kMaxTubes>() =
          column.head<kMaxTubes>() - compliance.cwiseProduct(column.segment<kMaxTubes>(rows::kTorsion));
      by_unknowns_.col(unknown).tail<3>() = guess_.end * (rotation_ * column.segment<3>(rows::kTurn));
    }
    by_unknowns_.bottomRightCorner<3, 3>() += Matrix3d::Identity();
    return;
  }
  const TubeVector compliance = trackTransmission(entry);
  base_angle_ = straightened - compliance.cwiseProduct(state_.torsion);
  // Derivatives of (psi - F t, turn in the base frame) by all columns.
  Eigen::Matrix<double, kLoadedUnknowns, kColumns> base;
  base.topRows<kMaxTubes>() =
      columns_.topRows<kMaxTubes>() - compliance.asDiagonal() * columns_.middleRows<kMaxTubes>(rows::kTorsion);
  base.bottomRows<3>() = (guess_.end * rotation_) * columns_.middleRows<3>(rows::kTurn);
  by_translation_ = base.rightCols<kMaxTubes>();
  for (int i = 0; i < arm_.tubeCount(); ++i)
    by_translation_(i, i) += state_.torsion[i] * entry.compliance[i] + entry.helix[i];
  const auto by_load = base.middleCols<6>(kForce);
  by_wrench_ = by_load * load_by_wrench_;
  by_unknowns_ = by_load * load_by_unknowns_;
  by_unknowns_.leftCols<kMaxTubes>() += base.leftCols<kMaxTubes>();
  by_unknowns_.bottomRightCorner<3, 3>() += Matrix3d::Identity();
}

/// The base point is fixed, so the end is at -end p; transfers the derivatives to the tool's tip.
void LoadedSweep::finish() {
  end_position_ = -(guess_.end * position_);
  const Vector3d tool = guess_.end * tool_, axis = guess_.end.col(2);
  tip_ = end_position_ + tool;
  const Eigen::Matrix<double, 3, kColumns> shift = (guess_.end * rotation_) * columns_.middleRows<3>(rows::kShift);
  const Eigen::Matrix<double, 3, 6> by_load = -shift.middleCols<6>(kForce);
  tip_by_unknowns_.setZero();
  tip_by_unknowns_.topRows<3>() = by_load * load_by_unknowns_;
  tip_by_unknowns_.topLeftCorner<3, kMaxTubes>() -= shift.leftCols<kMaxTubes>();
  tip_by_unknowns_.topRightCorner<3, 3>() -= skew(tip_);
  tip_by_unknowns_.bottomRightCorner<3, 3>().setIdentity();
  tip_by_unknowns_.col(0).head<3>() += axis.cross(tool);
  tip_by_unknowns_.col(0).tail<3>() += axis;
  tip_by_wrench_.setZero();
  tip_by_wrench_.topRows<3>() = by_load * load_by_wrench_;
  tip_by_translation_.setZero();
  tip_by_translation_.topRows<3>() = -shift.middleCols<kMaxTubes>(kTranslation);
}

}  // namespace tandem::kinematics
