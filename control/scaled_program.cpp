// SPDX-License-Identifier: Apache-2.0
#include "control/detail/scaled_program.h"

#include <algorithm>
#include <cmath>

namespace tandem::control {
namespace {

double largest(const auto& row) { return row.size() > 0 ? row.cwiseAbs().maxCoeff() : 0.0; }
double orOne(double size) { return size > 0.0 ? size : 1.0; }

}  // namespace

void ScaledProgram::chooseUnits(const QuadraticProgram& qp) {
  constexpr int kRounds = 8;
  const int n = qp.variables();
  unit_.setOnes(n);
  for (int i = 0; i < n; ++i) {
    if (const double width = qp.upper[i] - qp.lower[i]; std::isfinite(width) && width > 0.0)
      unit_[i] = width;
  }
  QpVector most(n);
  for (int round = 0; round < kRounds; ++round) {
    most.setZero();
    const auto see = [&](const auto& row) {
      const QpVector scaled = row.transpose().cwiseProduct(unit_).cwiseAbs();
      if (const double size = largest(scaled); size > 0.0)
        most = most.cwiseMax(scaled / size);
    };
    for (int j = 0; j < qp.equalities(); ++j)
      see(qp.E.row(j));
    for (int j = 0; j < qp.rows(); ++j)
      see(qp.A.row(j));
    for (int i = 0; i < n; ++i)
      see(qp.H.row(i));
    for (int i = 0; i < n; ++i)
      unit_[i] /= std::sqrt(orOne(most[i]));
  }
}

void ScaledProgram::set(const QuadraticProgram& original) {
  chooseUnits(original);
  qp_ = original;
  for (int i = 0; i < original.variables(); ++i) {
    const double unit = unit_[i];
    qp_.H.row(i) *= unit;
    qp_.H.col(i) *= unit;
    qp_.g[i] *= unit;
    qp_.E.col(i) *= unit;
    qp_.A.col(i) *= unit;
    qp_.lower[i] /= unit;
    qp_.upper[i] /= unit;
  }
  const double h = largest(qp_.H), g = largest(qp_.g);
  objective_ = orOne(h > 0.0 ? h : g);
  qp_.H /= objective_;
  qp_.g /= objective_;
  equality_.resize(original.equalities());
  for (int j = 0; j < original.equalities(); ++j) {
    equality_[j] = orOne(largest(qp_.E.row(j)));
    qp_.E.row(j) /= equality_[j];
    qp_.e[j] /= equality_[j];
  }
  row_.resize(original.rows());
  for (int j = 0; j < original.rows(); ++j) {
    row_[j] = orOne(largest(qp_.A.row(j)));
    qp_.A.row(j) /= row_[j];
    qp_.b[j] /= row_[j];
  }
}

void ScaledProgram::scale(QpSolution& solution) const {
  solution.x.array() /= unit_.array();
  solution.y.array() *= equality_.array() / objective_;
  solution.z.array() *= unit_.array() / objective_;
  solution.w.array() *= row_.array() / objective_;
}

void ScaledProgram::restore(QpSolution& solution) const {
  solution.x.array() *= unit_.array();
  solution.y.array() *= objective_ / equality_.array();
  solution.z.array() *= objective_ / unit_.array();
  solution.w.array() *= objective_ / row_.array();
}

}  // namespace tandem::control
