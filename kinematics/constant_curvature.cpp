// SPDX-License-Identifier: Apache-2.0
#include "kinematics/constant_curvature.h"

#include <array>
#include <cmath>

#include "kinematics/rotations.h"

namespace tandem::kinematics {
namespace {

/// Below this angle the series are used, because the closed forms lose digits by cancellation.
constexpr double kSeriesBelow = 0.5;
constexpr int kTerms = 8;  // remainder below 1e-17 at kSeriesBelow

/// sum_k (-1)^k c_k y^k by Horner, y = x^2.
double series(const std::array<double, kTerms>& c, double y) {
  double sum = 0.0;
  for (int k = kTerms - 1; k >= 0; --k)
    sum = c[static_cast<std::size_t>(k)] - y * sum;
  return sum;
}

double factorial(int n) {
  double f = 1.0;
  for (int i = 2; i <= n; ++i)
    f *= i;
  return f;
}

struct SeriesTables {
  std::array<double, kTerms> sinc, versine, cubic, d1, d2;
  SeriesTables() {
    for (int k = 0; k < kTerms; ++k) {
      const auto i = static_cast<std::size_t>(k);
      sinc[i] = 1.0 / factorial(2 * k + 1);     // sin x / x
      versine[i] = 1.0 / factorial(2 * k + 2);  // (1 - cos x) / x^2
      cubic[i] = 1.0 / factorial(2 * k + 3);    // (x - sin x) / x^3
      // (x cos x - sin x) / x^3 = -sum (-1)^k (2k+2) / (2k+3)! y^k
      d1[i] = -(2.0 * k + 2.0) / factorial(2 * k + 3);
      // (x sin x - 2 (1 - cos x)) / x^4 = -sum (-1)^k (2k+2) / (2k+4)! y^k
      d2[i] = -(2.0 * k + 2.0) / factorial(2 * k + 4);
    }
  }
};
const SeriesTables kTables;

}  // namespace

Arc::Arc(const Eigen::Vector3d& u, double length) : u_(u), length_(length) {
  const double x = u.norm() * length;
  const double L = length;
  double s1, s2, s3, t1, t2;
  if (x < kSeriesBelow) {
    const double y = x * x;
    s1 = series(kTables.sinc, y);
    s2 = series(kTables.versine, y);
    s3 = series(kTables.cubic, y);
    t1 = series(kTables.d1, y);
    t2 = series(kTables.d2, y);
  } else {
    const double sin_x = std::sin(x), cos_x = std::cos(x);
    s1 = sin_x / x;
    s2 = (1.0 - cos_x) / (x * x);
    s3 = (x - sin_x) / (x * x * x);
    t1 = (x * cos_x - sin_x) / (x * x * x);
    t2 = (x * sin_x - 2.0 * (1.0 - cos_x)) / (x * x * x * x);
  }
  f1_ = L * s1;
  f2_ = L * L * s2;
  f3_ = L * L * L * s3;
  g1_ = L * L * L * t1;
  g2_ = L * L * L * L * t2;
  const Eigen::Matrix3d ux = skew(u_);
  rotation_ = Eigen::Matrix3d::Identity() + f1_ * ux + f2_ * (ux * ux);
  position_ = f1_ * Eigen::Vector3d::UnitZ() + f2_ * u_.cross(Eigen::Vector3d::UnitZ());
}

Eigen::Vector3d Arc::positionDerivative(const Eigen::Vector3d& du) const {
  const double u_du = u_.dot(du);
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  return g1_ * u_du * z + g2_ * u_du * u_.cross(z) + f2_ * du.cross(z);
}

Eigen::Vector3d Arc::rotationDerivative(const Eigen::Vector3d& du) const {
  const Eigen::Vector3d u_x_du = u_.cross(du);
  return length_ * du + f2_ * u_x_du + f3_ * u_.cross(u_x_du);
}

}  // namespace tandem::kinematics
