// SPDX-License-Identifier: Apache-2.0
/** @file Stability determinant along the arm: minimum, and zeros (conjugate points). */
#pragma once

#include <Eigen/Cholesky>
#include <cmath>

#include "kinematics/concentric_tube.h"
#include "kinematics/scalar.h"
#include "kinematics/spectrum.h"

namespace tandem::kinematics {

/** Elastic stability of an equilibrium (Gilbert, Hendrick and Webster 2016; Ha, Park and Dupont 2016).
 *
 * Z(s) = d psi(s) / d theta is the derivative of the angles at s by the angles of the ends; under a wrench the
 * directions of the backbone at s and at the end are included, and kSize is larger by two. The equilibrium is a minimum
 * of energy, so stable, if and only if det Z(s) has no zero from the ends down to the motors, transmission included:
 * each zero is a conjugate point, where the part of the arm in front of s, held at s, is at its stability limit. det Z
 * is 1 at the end and stays 1 without elastic interaction; its smallest value is the measure of stability. A zero of
 * even multiplicity does not change the sign, so the index theorem counts the zeros instead: over a piece from s_k to
 * s_k+1 without a conjugate point of its own, their number is that of the negative eigenvalues of Z_k' B^-1 Z_k+1, with
 * B = d psi_k+1 / d (moment at s_k). */
template <class Scalar, int kSize = kMaxTubes>
class DeterminantTrack {
 public:
  using Square = Eigen::Matrix<Scalar, kSize, kSize>;
  using SquareForm = Eigen::Matrix<double, kSize, kSize>;

  /// @param s_end end of the arm, m
  explicit DeterminantTrack(double s_end = 0.0) : at_(s_end) {}

  const Scalar& minimum() const { return minimum_; }
  double at() const { return at_; }  ///< s of the minimum, m
  int conjugatePoints() const { return conjugate_points_; }

  /// Z and its derivative by x, which runs from 0 to 1 over a piece.
  struct Place {
    Square z, slope;
  };

  /// Adds the piece from s_begin back to s_end; interior(x) gives the Place in between.
  template <class Interior>
  void add(double s_begin, double s_end, const Place& begin, const Place& end, const Interior& interior) {
    propose(determinant(end.z), s_end);
    if (determinantSlope(begin) >= 0.0 || determinantSlope(end) <= 0.0)
      return;
    double low = 0.0, high = 1.0;  // the determinant's slope changes from negative to positive between them
    for (int i = 0; i < kBisections; ++i) {
      const double middle = 0.5 * (low + high);
      (determinantSlope(interior(middle)) < 0.0 ? low : high) = middle;
    }
    const double x = 0.5 * (low + high);
    propose(determinant(interior(x).z), s_begin + x * (s_end - s_begin));
  }

  /// Parts of a piece of helical tubes: the angles between them turn along it, so the determinant may fall and rise
  /// again where its slope at the ends does not show it.
  static constexpr int kHelicalParts = 8;

  /// The same part by part, of equal length.
  template <class Interior>
  void addInParts(int parts,
                  double s_begin,
                  double s_end,
                  const Place& begin,
                  const Place& end,
                  const Interior& interior) {
    const double share = 1.0 / parts, length = s_end - s_begin;
    Place from = begin;
    for (int k = 0; k < parts; ++k) {
      const bool last = k + 1 == parts;
      const Place to = last ? end : interior((k + 1) * share);
      add(s_begin + k * share * length, last ? s_end : s_begin + (k + 1) * share * length, from, to,
          [&](double x) { return interior((k + x) * share); });
      from = to;
    }
  }

  /// Counts the conjugate points of a piece; `form` is Z_k' B^-1 Z_k+1, with a positive diagonal for absent tubes.
  void count(const SquareForm& form) {
    if (!positive(form))
      conjugate_points_ += negativeDirections(form);
  }

  /// The same without a potential, and so without symmetry: counts eigenvalues with a negative real part. Their number
  /// is odd if the determinant changes its sign.
  void countUnsymmetric(const SquareForm& form) {
    if (!positive(form))
      conjugate_points_ += negativeRealParts(form);
  }

 private:
  static constexpr int kBisections = 30;

  /// The symmetric part is positive definite: true in most cases, and faster to check than eigenvalues.
  static bool positive(const SquareForm& form) {
    return SquareForm(0.5 * (form + form.transpose())).llt().info() == Eigen::Success;
  }

  void propose(const Scalar& value, double s) {
    if (valueOf(value) < valueOf(minimum_)) {
      minimum_ = value;
      at_ = s;
    }
  }
  static Scalar determinant(const Square& m) {
    if constexpr (kSize == 4)
      return laplace(m);
    else
      return eliminated(m);
  }
  /// Row of the largest number of column k from the diagonal down.
  template <class Matrix>
  static int pivotRow(const Matrix& m, int k) {
    using std::abs;
    int pivot = k;
    for (int i = k + 1; i < kSize; ++i) {
      if (abs(m(i, k)) > abs(m(pivot, k)))
        pivot = i;
    }
    return pivot;
  }
  /// By elimination with row pivots.
  template <class Matrix>
  static typename Matrix::Scalar eliminated(Matrix m) {
    typename Matrix::Scalar product(1.0);
    for (int k = 0; k < kSize; ++k) {
      if (const int pivot = pivotRow(m, k); pivot != k) {
        m.row(k).swap(m.row(pivot));
        product = -product;
      }
      product *= m(k, k);
      if (m(k, k) == 0.0)
        return product;
      for (int i = k + 1; i < kSize; ++i) {
        const typename Matrix::Scalar factor = m(i, k) / m(k, k);
        for (int j = k + 1; j < kSize; ++j)
          m(i, j) -= factor * m(k, j);
      }
    }
    return product;
  }
  /// By 2 x 2 minors of the upper and the lower rows, for any scalar.
  static Scalar laplace(const Square& m) {
    const auto minor = [&](int row, int a, int b) {
      return Scalar(m(row, a) * m(row + 1, b) - m(row, b) * m(row + 1, a));
    };
    Scalar sum = minor(0, 0, 1) * minor(2, 2, 3);
    sum -= minor(0, 0, 2) * minor(2, 1, 3);
    sum += minor(0, 0, 3) * minor(2, 1, 2);
    sum += minor(0, 1, 2) * minor(2, 0, 3);
    sum -= minor(0, 1, 3) * minor(2, 0, 2);
    sum += minor(0, 2, 3) * minor(2, 0, 1);
    return sum;
  }
  /// Derivative of det Z by x; holds for singular Z too.
  static double determinantSlope(const Place& place) {
    const SquareForm z = valuesOf(place.z), slope = valuesOf(place.slope);
    if constexpr (kSize == 4)
      return laplaceSlope(z, slope);
    else
      return eliminatedSlope(z, slope);
  }
  /// The slope of the sum of products of minors.
  static double laplaceSlope(const SquareForm& z, const SquareForm& slope) {
    const auto product = [&](int a, int b, int c, int d) {
      const double upper = z(0, a) * z(1, b) - z(0, b) * z(1, a), lower = z(2, c) * z(3, d) - z(2, d) * z(3, c);
      const double upper_slope =
          slope(0, a) * z(1, b) + z(0, a) * slope(1, b) - slope(0, b) * z(1, a) - z(0, b) * slope(1, a);
      const double lower_slope =
          slope(2, c) * z(3, d) + z(2, c) * slope(3, d) - slope(2, d) * z(3, c) - z(2, d) * slope(3, c);
      return upper_slope * lower + upper * lower_slope;
    };
    return product(0, 1, 2, 3) - product(0, 2, 1, 3) + product(0, 3, 1, 2) + product(1, 2, 0, 3) - product(1, 3, 0, 2) +
           product(2, 3, 0, 1);
  }
  /// The slope by the elimination that gives the determinant.
  static double eliminatedSlope(SquareForm z, SquareForm slope) {
    double product = 1.0, product_slope = 0.0;
    for (int k = 0; k < kSize; ++k) {
      if (const int pivot = pivotRow(z, k); pivot != k) {
        z.row(k).swap(z.row(pivot));
        slope.row(k).swap(slope.row(pivot));
        product = -product;
        product_slope = -product_slope;
      }
      if (z(k, k) == 0.0) {  // to first order, the determinant is that with the slope of this column
        z.topRows(k).setIdentity();
        z.col(k).tail(kSize - k) = slope.col(k).tail(kSize - k);
        z.bottomLeftCorner(kSize - k, k).setZero();
        return product * eliminated<SquareForm>(z);
      }
      product_slope = product_slope * z(k, k) + product * slope(k, k);
      product *= z(k, k);
      for (int i = k + 1; i < kSize; ++i) {
        const double factor = z(i, k) / z(k, k);
        const double factor_slope = (slope(i, k) - factor * slope(k, k)) / z(k, k);
        for (int j = k + 1; j < kSize; ++j) {
          slope(i, j) -= factor_slope * z(k, j) + factor * slope(k, j);
          z(i, j) -= factor * z(k, j);
        }
      }
    }
    return product_slope;
  }

  Scalar minimum_{1.0};
  double at_;
  int conjugate_points_ = 0;
};

}  // namespace tandem::kinematics
