// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "kinematics/detail/loaded_state.h"
#include "kinematics/detail/transmission.h"

namespace tandem::kinematics {

using namespace loaded_state;
using Eigen::Matrix3d;

/// Derivatives of the rows from `row` on of (psi, t) and of the turn, in the end frame, by a variation of the end;
/// minus the turn of the end frame itself.
LoadedSweep::ByVariation LoadedSweep::byVariation(const State& y, int row) const {
  const auto column = columns(y);
  Eigen::Matrix<double, kMaxTubes + 3, kTranslation> direct;
  direct << column.block<kMaxTubes, kTranslation>(row, 0), column.block<3, kTranslation>(kTurn, 0);
  ByVariation result = direct.rightCols<6>() * load_by_variation_;
  result.leftCols<kMaxTubes>() += direct.leftCols<kMaxTubes>();
  return result;
}

/// Z and its derivative over a step of this length. Beyond a tube's end its row is that of the identity.
LoadedSweep::Track::Place LoadedSweep::place(const Interval& part, const State& y, double length) const {
  State slope;
  derivative(part, y, slope);
  ByVariation here = byVariation(y, 0);
  here.block<2, 2>(kMaxTubes, kMaxTubes).diagonal().array() += 1.0;
  const ByVariation change = length * byVariation(slope, 0);
  const Matrix3d r = rotation(y), dr = length * rotation(slope);
  const Eigen::Matrix<double, 3, kVariation> turn = r.transpose() * here.bottomRows<3>();
  const Eigen::Matrix<double, 3, kVariation> dturn =
      r.transpose() * change.bottomRows<3>() + dr.transpose() * here.bottomRows<3>();
  Track::Place place;
  place.z << here.topRows<kMaxTubes>(), turn.topRows<2>();
  place.slope << change.topRows<kMaxTubes>(), dturn.topRows<2>();
  for (int i = 0; i < kMaxTubes; ++i) {
    if (part.present[i]) {
      place.z.row(i) += turn.row(2);
      place.slope.row(i) += dturn.row(2);
    }
  }
  return place;
}

/// Adds the step from `before` at s_ to y_, for the minimum and the index of DeterminantTrack.
void LoadedSweep::track(const Interval& part, const State& before, double length) {
  const Track::Place distal = place(part, before, length), proximal = place(part, y_, length);
  if (refine_) {
    track_.add(s_, s_ - length, distal, proximal,
               [&](double x) { return place(part, advanced(part, before, x * length), length); });
  }
  const auto column = columns(y_).rightCols<kVariation>();
  const Eigen::Matrix<double, 3, kVariation> turn = rotation(y_).transpose() * column.middleRows<3>(kTurn);
  Variation by_moment;
  by_moment << column.topRows<kMaxTubes>(), turn.topRows<2>();
  for (int i = 0; i < kMaxTubes; ++i) {
    if (part.present[i])
      by_moment.row(i) += turn.row(2);
    else
      by_moment(i, i) = 1.0;
  }
  count(distal.z.transpose() * by_moment.partialPivLu().solve(proximal.z));
}

void LoadedSweep::count(const Variation& form) {
  if (has_potential_)
    track_.count(form);
  else
    track_.countUnsymmetric(form);
}

/// Behind the entry point the backbone is guided: modelled as a very stiff constraint of its direction.
TubeVector LoadedSweep::trackTransmission(const Interval& entry) {
  const Variation z = place(entry, y_, 0.0).z;
  const ByVariation moment = byVariation(y_, kMaxTubes);
  Variation motor = z;
  double s = 0.0;
  const TubeVector compliance =
      crossTransmission<double>(arm_, parts_, beta_, [&](const TubeVector& added, double end) {
        const Variation begin = motor;
        Variation slope = Variation::Zero();
        slope.topRows<kMaxTubes>() = -(added.asDiagonal() * moment.topRows<kMaxTubes>());
        motor += slope;
        if (refine_) {
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
  count(z.transpose() * force);
  return compliance;
}

}  // namespace tandem::kinematics
