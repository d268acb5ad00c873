// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "kinematics/detail/loaded_pieces.h"
#include "kinematics/detail/transmission.h"

namespace tandem::kinematics {

using Eigen::Matrix3d;
namespace rows = loaded_pieces;

namespace {

using Track = LoadedSweep::Track;
using Variations = rows::Columns<LoadedSweep::kVariation>;

/// Angles of the tubes and tilt of the backbone. Beyond a tube's end its row is that of the identity.
template <int C>
auto variationOf(const LoadedPart& part, const rows::Columns<C>& columns) {
  Eigen::Matrix<double, LoadedSweep::kVariation, C> variation;
  variation << columns.template topRows<kMaxTubes>(), columns.template middleRows<2>(rows::kTurn);
  for (int i = 0; i < kMaxTubes; ++i) {
    if (part.present[i])
      variation.row(i) += columns.row(rows::kTurn + 2);
  }
  return variation;
}

/// Z and its derivative over a piece of this length.
Track::Place place(const LoadedPart& part, const LoadedState& state, const Variations& columns, double length) {
  using Row = Eigen::Matrix<double, 1, LoadedSweep::kVariation>;
  Row ux = columns.row(rows::kMoment), uy = columns.row(rows::kMoment + 1);
  for (int c = 0; c < part.curved_count; ++c) {
    const int i = part.curved[c];
    ux -= part.b[i] * std::cos(state.psi[i]) * columns.row(i);
    uy -= part.b[i] * std::sin(state.psi[i]) * columns.row(i);
  }
  const Eigen::Vector2d u = state.bend(part);
  const auto w = columns.middleRows<3>(rows::kTurn);
  Variations slope = Variations::Zero();
  slope.topRows<kMaxTubes>() = -length * (part.compliance.asDiagonal() * columns.middleRows<kMaxTubes>(rows::kTorsion));
  slope.row(rows::kTurn) = length * (u.y() * w.row(2) - ux / part.total);
  slope.row(rows::kTurn + 1) = length * (-u.x() * w.row(2) - uy / part.total);
  slope.row(rows::kTurn + 2) = length * (u.x() * w.row(1) - u.y() * w.row(0));
  return {variationOf(part, columns), variationOf(part, slope)};
}

/// B: variation at the end of a piece by the moments that hold its beginning, but for a factor; 1 for absent tubes.
template <int N>
Track::Square byMoments(const LoadedSeries& series, const rows::Columns<N>& transition) {
  const LoadedPart& part = series.part();
  const Eigen::Matrix<double, LoadedSweep::kVariation, N> all = variationOf(part, transition);
  const int count = part.curved_count;
  Track::Square by_moment = Track::Square::Zero();
  for (int c = 0; c < count; ++c)
    by_moment.col(part.curved[c]) = all.col(count + c);
  for (int i = 0; i < kMaxTubes; ++i) {
    if (part.present[i] && !part.isCurved(i)) {
      by_moment.col(i) = all.col(2 * count);
      by_moment(i, i) -= series.length() * part.compliance[i];
    }
  }
  by_moment.rightCols<2>() = all.template middleCols<2>(2 * count + 1);
  by_moment *= -part.total / series.length();  // backwards along s; the size has no influence
  for (int i = 0; i < kMaxTubes; ++i) {
    if (!part.present[i])
      by_moment(i, i) = 1.0;
  }
  return by_moment;
}

}  // namespace

/// Columns by a variation of the end, its own turn included. @param rotation of the present frame
LoadedSweep::Variations LoadedSweep::variations(const Matrix3d& rotation) const {
  Variations result = columns_.middleCols<6>(kForce).lazyProduct(load_by_variation_);
  result.leftCols<kMaxTubes>() += columns_.leftCols<kMaxTubes>();
  result.block<3, 2>(rows::kTurn, kMaxTubes) += rotation.transpose().leftCols<2>();
  return result;
}

/// Adds a piece that begins at the present position, for the minimum and the index of DeterminantTrack.
/// @param start variations there; the columns are those at the end
template <int N>
void LoadedSweep::track(const LoadedSeries& series,
                        const LoadedColumns<N>& basis,
                        const Columns<N>& transition,
                        const LoadedPoint& end,
                        const Variations& start) {
  const LoadedPart& part = series.part();
  const double length = series.length();
  const auto within = [&](double x) {
    const LoadedPoint point = series.at(x);
    const Columns<N> here = rows::endOf<N>(part, basis.at(point));
    return place(part, point.state, rows::carried<N, kVariation>(series, here, point, start), length);
  };
  const Track::Place distal = place(part, state_, start, length);
  const Track::Place proximal = place(part, end.state, variations(rotation_ * end.rotation), length);
  if (depth_ == LoadedDepth::kTip) {
    // In halves, because the determinant begins level at the arm's end.
    const int parts = part.helix.isZero(0.0) ? 2 : Track::kHelicalParts;
    track_.addInParts(parts, s_, s_ - length, distal, proximal, within);
  }
  count(distal.z.transpose() * byMoments(series, transition).partialPivLu().solve(proximal.z));
}

template void LoadedSweep::track(const LoadedSeries&,
                                 const LoadedColumns<6>&,
                                 const Columns<6>&,
                                 const LoadedPoint&,
                                 const Variations&);
template void LoadedSweep::track(const LoadedSeries&,
                                 const LoadedColumns<8>&,
                                 const Columns<8>&,
                                 const LoadedPoint&,
                                 const Variations&);
template void LoadedSweep::track(const LoadedSeries&,
                                 const LoadedColumns<10>&,
                                 const Columns<10>&,
                                 const LoadedPoint&,
                                 const Variations&);
template void LoadedSweep::track(const LoadedSeries&,
                                 const LoadedColumns<12>&,
                                 const Columns<12>&,
                                 const LoadedPoint&,
                                 const Variations&);
template void LoadedSweep::track(const LoadedSeries&,
                                 const LoadedColumns<14>&,
                                 const Columns<14>&,
                                 const LoadedPoint&,
                                 const Variations&);

void LoadedSweep::count(const Variation& form) {
  if (has_potential_)
    track_.count(form);
  else
    track_.countUnsymmetric(form);
}

/// Behind the entry point the backbone is guided: modelled as a very stiff constraint of its direction.
TubeVector LoadedSweep::trackTransmission(const LoadedPart& entry) {
  const Variations columns = variations(rotation_);
  const Variation z = variationOf(entry, columns);
  const auto moment = columns.middleRows<kMaxTubes>(rows::kTorsion);
  Variation motor = z;
  double s = 0.0;
  const TubeVector compliance =
      crossTransmission<double>(arm_, parts_, beta_, [&](const TubeVector& added, double end) {
        const Variation begin = motor;
        Variation slope = Variation::Zero();
        slope.topRows<kMaxTubes>() = -(added.asDiagonal() * moment);
        motor += slope;
        if (depth_ == LoadedDepth::kTip) {
          track_.add(s, end, {begin, slope}, {motor, slope}, [&](double x) {
            return Track::Place{begin + x * slope, slope};
          });
        }
        s = end;
      });
  Variation force = motor;
  for (int i = 0; i < arm_.tubeCount(); ++i) {
    if (entry.present[i])
      force.row(i) /= std::max(compliance[i], kShortestTransmission * entry.compliance[i]);
  }
  force.bottomRows<2>() *= entry.total / kShortestTransmission;
  if (depth_ >= LoadedDepth::kPath)
    count(z.transpose() * force);
  return compliance;
}

}  // namespace tandem::kinematics
