// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics/energy_oracle.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>

#include "tests/unit/kinematics/helix_oracle.h"

namespace tandem::test {
namespace {

/// Twist per moment of a tube from `s` (below zero) to the entry point, rad / (N m).
double complianceBehind(const kinematics::Tube& tube, double beta, double s) {
  double sum = 0.0, begin = beta;
  for (const auto& section : tube.sections) {
    const double end = begin + section.length;
    sum += std::max(0.0, std::min(end, 0.0) - std::max(begin, s)) / section.torsional_stiffness;
    begin = end;
  }
  return sum;
}

}  // namespace

EnergyOracle::EnergyOracle(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, double longest_element)
    : arm_(arm), n_(arm.tubeCount()), beta_(q.head(n_)), alpha_(q.tail(n_)), compliance_(n_), turn_(n_) {
  std::set<double> places{0.0};
  for (int i = 0; i < n_; ++i) {
    double s = q[i];
    for (const auto& section : arm.tubes[i].sections) {
      s += section.length;
      if (s > 0.0)
        places.insert(s);
    }
    compliance_[i] = complianceBehind(arm.tubes[i], q[i], q[i]);
    turn_[i] = turnBehindEntry(arm.tubes[i], q[i]);
  }
  double last = q[0];  // summed as above, so that rounding leaves no tiny interval at its end
  for (const auto& section : arm.tubes[0].sections)
    last += section.length;
  for (auto it = places.begin(); *it < last;) {
    // Intervals below a nanometre would make the elements' matrices singular.
    const double begin = *it;
    while (*it < last && *it - begin < 1e-9)
      ++it;
    const double length = *it - begin;
    if (length < 1e-9)
      break;
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / longest_element)));
    Element element;
    element.b = element.torsion = element.helix = Vector::Zero(n_);
    for (int i = 0; i < n_; ++i) {
      double end = q[i];
      for (const auto& section : arm.tubes[i].sections) {
        end += section.length;
        if (begin + 0.5 * length < end) {
          element.stiffness += section.bending_stiffness;
          element.b[i] = section.bending_stiffness * section.curvature;
          element.torsion[i] = section.torsional_stiffness;
          element.helix[i] = section.helix_torsion;
          break;
        }
      }
    }
    for (int k = 0; k < pieces; ++k) {
      element.begin = begin + length * k / pieces;
      element.end = k + 1 == pieces ? *it : begin + length * (k + 1) / pieces;
      element_.push_back(element);
    }
  }
}

bool EnergyOracle::reaches(int tube, int node) const { return element_[std::max(0, node - 1)].torsion[tube] > 0.0; }

EnergyOracle::Vector EnergyOracle::torque(const Element& element, const Vector& psi) const {
  Vector result = Vector::Zero(n_);
  for (int i = 0; i < n_; ++i) {
    for (int j = 0; j < n_; ++j)
      result[i] += element.b[i] * element.b[j] / element.stiffness * std::sin(psi[i] - psi[j]);
  }
  return result;
}

EnergyOracle::Square EnergyOracle::torqueByAngle(const Element& element, const Vector& psi) const {
  Square result = Square::Zero(n_, n_);
  for (int i = 0; i < n_; ++i) {
    for (int j = 0; j < n_; ++j) {
      const double part = element.b[i] * element.b[j] / element.stiffness * std::cos(psi[i] - psi[j]);
      result(i, i) += part;
      result(i, j) -= part;
    }
  }
  return result;
}

EnergyOracle::State EnergyOracle::slope(const Element& element, const State& x) const {
  State dx = State::Zero(2 * n_, n_ + 1);
  for (int i = 0; i < n_; ++i) {
    if (element.torsion[i] > 0.0)
      dx.row(i) = x.row(n_ + i) / element.torsion[i];
  }
  dx.col(0).head(n_) += element.helix;
  const Vector psi = x.col(0).head(n_);
  dx.col(0).tail(n_) = torque(element, psi);
  dx.bottomRightCorner(n_, n_) = torqueByAngle(element, psi) * x.topRightCorner(n_, n_);
  return dx;
}

EnergyOracle::Angles EnergyOracle::shoot(const Vector& theta) {
  State x = State::Zero(2 * n_, n_ + 1);
  x.col(0).head(n_) = theta;
  x.topRightCorner(n_, n_).setIdentity();
  Angles psi(n_, nodes());
  psi.rightCols(1) = theta;
  smallest_determinant_ = 1.0;
  for (int k = nodes() - 2; k >= 0; --k) {
    const Element& element = element_[k];
    const double h = element.begin - element.end;
    const State k1 = slope(element, x), k2 = slope(element, x + 0.5 * h * k1), k3 = slope(element, x + 0.5 * h * k2),
                k4 = slope(element, x + h * k3);
    x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    psi.col(k) = x.col(0).head(n_);
    smallest_determinant_ = std::min(smallest_determinant_, x.topRightCorner(n_, n_).determinant());
  }
  entry_ = x;
  alpha_ = x.col(0).head(n_) - x.col(0).tail(n_).cwiseProduct(compliance_) - turn_;
  return psi;
}

EnergyOracle::Square EnergyOracle::byEnd(double s) const {
  Square result = entry_.topRightCorner(n_, n_);
  for (int i = 0; i < n_; ++i)
    result.row(i) -= entry_.row(n_ + i).tail(n_) * complianceBehind(arm_.tubes[i], beta_[i], s);
  return result;
}

double EnergyOracle::smallestDeterminant() const {
  constexpr int kPieces = 2000;
  double smallest = smallest_determinant_;
  for (int k = 1; k <= kPieces; ++k)
    smallest = std::min(smallest, byEnd(beta_.minCoeff() * k / kPieces).determinant());
  return smallest;
}

EnergyOracle::Angles EnergyOracle::interpolate(const std::vector<kinematics::ShapePoint>& shape) const {
  Angles psi = Angles::Zero(n_, nodes());
  for (int k = 0; k < nodes(); ++k) {
    const Element& element = element_[std::max(0, k - 1)];
    const auto above = std::upper_bound(shape.begin() + 1, shape.end() - 1, place(k),
                                        [](double s, const kinematics::ShapePoint& point) { return s < point.s; });
    for (int i = 0; i < n_; ++i) {
      const auto right = above, left = right - 1;
      const double h = right->s - left->s, x = (place(k) - left->s) / h;
      if (!reaches(i, k) || std::isnan(left->psi[i]))
        continue;
      const double helix = h * element.helix[i], d0 = h * left->moment[i] / element.torsion[i] + helix;
      if (std::isnan(right->psi[i])) {  // the tube ends between the samples, where its moment is almost zero
        psi(i, k) = left->psi[i] + (0.5 * (d0 - helix) + helix) * x;
        continue;
      }
      const double d1 = h * right->moment[i] / element.torsion[i] + helix, y = 1.0 - x;
      psi(i, k) = left->psi[i] * y * y * (1.0 + 2.0 * x) + right->psi[i] * x * x * (3.0 - 2.0 * x) + d0 * x * y * y -
                  d1 * x * x * y;
    }
  }
  return psi;
}

double EnergyOracle::value(const Angles& psi) const {
  double sum = 0.0;
  for (int i = 0; i < n_; ++i) {
    if (compliance_[i] > 0.0 && reaches(i, 0))
      sum += 0.5 * std::pow(psi(i, 0) - alpha_[i] - turn_[i], 2) / compliance_[i];
  }
  for (int k = 0; k + 1 < nodes(); ++k) {
    const Element& element = element_[k];
    const double h = element.end - element.begin;
    for (const double x : {0.5 - std::sqrt(1.0 / 12.0), 0.5 + std::sqrt(1.0 / 12.0)}) {
      double across = 0.0, along = 0.0;
      for (int i = 0; i < n_; ++i) {
        const double angle = (1.0 - x) * psi(i, k) + x * psi(i, k + 1);
        across += element.b[i] * std::cos(angle);
        along += element.b[i] * std::sin(angle);
      }
      sum -= 0.25 * h * (across * across + along * along) / element.stiffness;
    }
    for (int i = 0; i < n_; ++i)
      sum += 0.5 * element.torsion[i] * std::pow(psi(i, k + 1) - psi(i, k) - element.helix[i] * h, 2) / h;
  }
  return sum;
}

int EnergyOracle::negativeDirections(const Angles& psi) const {
  // Block elimination: the signs of the pivots' eigenvalues are those of the Hessian's (Sylvester).
  int negative = 0;
  Square pivot = Square::Zero(n_, n_);
  for (int i = 0; i < n_; ++i)
    pivot(i, i) = reaches(i, 0) ? 1.0 / std::max(compliance_[i], 1e-6) : 1.0;
  for (int k = 0; k + 1 < nodes(); ++k) {
    const Element& element = element_[k];
    const double h = element.end - element.begin;
    Square stretch = Square::Zero(n_, n_);
    for (int i = 0; i < n_; ++i)
      stretch(i, i) = element.torsion[i] / h;
    const Vector middle = 0.5 * (psi.col(k) + psi.col(k + 1));
    const Square quarter = 0.25 * h * torqueByAngle(element, middle);
    const Square upper = quarter - stretch;
    pivot += stretch + quarter;
    const Eigen::SelfAdjointEigenSolver<Square> eigen(pivot);
    negative += static_cast<int>((eigen.eigenvalues().array() < 0.0).count());
    const Square eliminated = eigen.eigenvectors() * (eigen.eigenvalues().cwiseInverse().asDiagonal() *
                                                      (eigen.eigenvectors().transpose() * upper));
    pivot = stretch + quarter - upper.transpose() * eliminated;
    for (int i = 0; i < n_; ++i) {
      if (element.torsion[i] == 0.0) {
        pivot.row(i).setZero();
        pivot.col(i).setZero();
        pivot(i, i) = 1.0;
      }
    }
  }
  const Eigen::SelfAdjointEigenSolver<Square> eigen(pivot);
  return negative + static_cast<int>((eigen.eigenvalues().array() < 0.0).count());
}

}  // namespace tandem::test
