// SPDX-License-Identifier: Apache-2.0
/** @file Derivatives of a LoadedSeries by its start. */
#pragma once

#include "kinematics/loaded_series.h"

namespace tandem::kinematics {

/** N derivatives of the state that a piece begins with, as series along it: the variational equations of LoadedSeries,
 *
 *   dpsi_i' = -dt_i / c_i,  dt_i' = -b_i (du_x cos psi_i + du_y sin psi_i + (u_y cos psi_i - u_x sin psi_i) dpsi_i),
 *   dm' = du x m + u x dm + e_z x dn,  dn = n x w + R' dn(0),  w' = u x w - du,  v' = u x v + e_z x w,
 *
 * with the turn w and the shift v of the moving frame, in it; both are zero at the start. All series have the order of
 * the solution, which its own terms and the rate of the linear parts determine. */
template <int N>
class LoadedColumns {
 public:
  using Row = Eigen::Array<double, N, 1>;
  struct Start {
    std::array<Row, kMaxTubes> psi, torsion;  ///< of curved tubes, in their order
    Row straight;                             ///< sum of dt_i over straight tubes, constant along the piece
    std::array<Row, 2> moment;
    std::array<Row, 3> force;
  };
  struct End {
    std::array<Row, kMaxTubes> psi, torsion;
    std::array<Row, 2> moment;
    std::array<Row, 3> force, turn, shift;
  };

  /// @param shifts also integrate the frame's shift
  LoadedColumns(const LoadedSeries& series, const Start& start, bool shifts)
      : series_(series), shifts_(shifts), order_(series.order()), force_(start.force) {
    for (int c = 0; c < series_.part().curved_count; ++c) {
      psi_[0][c] = start.psi[c];
      torsion_[0][c] = start.torsion[c];
    }
    moment_[0] = start.moment;
    for (int i = 0; i < 3; ++i)
      turn_[0][i] = shift_[0][i] = Row::Zero();
    for (int k = 0; k <= order_; ++k) {
      expandBend(k);
      expandTorsion(k, start.straight);
      expandMoment(k);
      expandFrame(k);
    }
  }

  End at(const LoadedPoint& point) const {
    const double x = point.x;
    End end;
    for (int c = 0; c < series_.part().curved_count; ++c) {
      end.psi[c] = horner(x, [&](int k) -> const Row& { return psi_[k][c]; });
      end.torsion[c] = horner(x, [&](int k) -> const Row& { return torsion_[k][c]; });
    }
    for (int i = 0; i < 2; ++i)
      end.moment[i] = horner(x, [&](int k) -> const Row& { return moment_[k][i]; });
    for (int i = 0; i < 3; ++i) {
      end.turn[i] = horner(x, [&](int k) -> const Row& { return turn_[k][i]; });
      end.shift[i] = shifts_ ? horner(x, [&](int k) -> const Row& { return shift_[k][i]; }) : Row(Row::Zero());
    }
    const Eigen::Matrix3d& r = point.rotation;
    const Eigen::Vector3d& n = point.state.force;
    const std::array<Row, 3>& w = end.turn;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      end.force[i] = n[j] * w[k] - n[k] * w[j] + r(0, i) * force_[0] + r(1, i) * force_[1] + r(2, i) * force_[2];
    }
    return end;
  }

 private:
  template <class Coefficient>
  Row horner(double x, const Coefficient& coefficient) const {
    Row sum = coefficient(order_ + 1);
    for (int k = order_; k >= 0; --k)
      sum = sum * x + coefficient(k);
    return sum;
  }

  void expandBend(int k) {
    const auto& a = series_.terms();
    Row sx = moment_[k][0], sy = moment_[k][1];
    for (int c = 0; c < series_.part().curved_count; ++c) {
      for (int l = 0; l <= k; ++l) {
        sx -= a.cosine[k - l][c] * psi_[l][c];
        sy -= a.sine[k - l][c] * psi_[l][c];
      }
    }
    bend_[k] = {sx / series_.part().total, sy / series_.part().total};
  }

  void expandTorsion(int k, const Row& straight) {
    const auto& a = series_.terms();
    const double scale = series_.length() / (k + 1);
    Row sum = k == 0 ? straight : Row(Row::Zero());
    for (int c = 0; c < series_.part().curved_count; ++c) {
      Row torque = Row::Zero();
      for (int l = 0; l <= k; ++l)
        torque += a.cosine[k - l][c] * bend_[l][0] + a.sine[k - l][c] * bend_[l][1] + a.own[k - l][c] * psi_[l][c];
      sum += torsion_[k][c];
      torsion_[k + 1][c] = -scale * torque;
      psi_[k + 1][c] = (-scale * series_.part().compliance[series_.part().curved[c]]) * torsion_[k][c];
    }
    along_[k] = sum;
  }

  void expandMoment(int k) {
    const auto& a = series_.terms();
    const double scale = series_.length() / (k + 1);
    // du x m + u x dm - (dn_y, -dn_x)
    Row mx = -(a.r2[k].x() * force_[0] + a.r2[k].y() * force_[1] + a.r2[k].z() * force_[2]);
    Row my = a.r1[k].x() * force_[0] + a.r1[k].y() * force_[1] + a.r1[k].z() * force_[2];
    for (int l = 0; l <= k; ++l) {
      const int j = k - l;
      const std::array<Row, 3>& w = turn_[l];
      mx += a.mz[j] * bend_[l][1] + a.uy[j] * along_[l] - (a.nz[j] * w[0] - a.nx[j] * w[2]);
      my += a.ny[j] * w[2] - a.nz[j] * w[1] - a.mz[j] * bend_[l][0] - a.ux[j] * along_[l];
    }
    moment_[k + 1] = {scale * mx, scale * my};
  }

  void expandFrame(int k) {
    const auto& a = series_.terms();
    const double scale = series_.length() / (k + 1);
    const auto cross = [&](const std::array<std::array<Row, 3>, LoadedSeries::kMaxOrder + 3>& v, Row x, Row y, Row z,
                           std::array<Row, 3>& next) {
      for (int l = 0; l <= k; ++l) {
        const double ux = a.ux[k - l], uy = a.uy[k - l];
        x += uy * v[l][2];
        y -= ux * v[l][2];
        z += ux * v[l][1] - uy * v[l][0];
      }
      next = {scale * x, scale * y, scale * z};
    };
    cross(turn_, -bend_[k][0], -bend_[k][1], Row::Zero(), turn_[k + 1]);
    if (shifts_)
      cross(shift_, -turn_[k][1], turn_[k][0], Row::Zero(), shift_[k + 1]);
  }

  const LoadedSeries& series_;
  bool shifts_;
  int order_;
  std::array<Row, 3> force_;
  template <class Term>
  using Terms = LoadedSeries::Terms<Term>;
  Terms<std::array<Row, kMaxTubes>> psi_, torsion_;
  Terms<std::array<Row, 2>> moment_, bend_;
  Terms<Row> along_;
  Terms<std::array<Row, 3>> turn_, shift_;
};

}  // namespace tandem::kinematics
