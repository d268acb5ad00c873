// SPDX-License-Identifier: Apache-2.0
#include "kinematics/cosserat/detail/strain.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "kinematics/rotations.h"

namespace tandem::kinematics::cosserat {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Direction of a tendon in the rod's frame, and its derivative B (du, dv) by the strains: B = [-[r]x, I].
struct Tendon {
  Tendon(const Vector3d& offset, const Strain& strain) : w(strain.v + strain.u.cross(offset)), length(w.norm()) {
    w /= length;
    along << offset.cross(w), w;
  }
  Vector3d w;
  double length;
  Vector6 along;  ///< B' w: (m, n) per unit of tension
};

void addStiffness(const Tendon& tendon, const Vector3d& offset, double tension, Matrix6& stiffness) {
  Eigen::Matrix<double, 3, 6> b;
  b << -skew(offset), Matrix3d::Identity();
  const Eigen::Matrix<double, 3, 6> across = b - tendon.w * tendon.along.transpose();
  stiffness += tension / tendon.length * b.transpose() * across;
}

}  // namespace

bool solveStrain(const SectionLaw& law, const Vector3d& m, const Vector3d& n, Strain& strain) noexcept {
  if (law.tendons == 0) {
    strain.u = law.curvature + law.moment_compliance.cwiseProduct(m);
    strain.v = Vector3d::UnitZ() + law.force_compliance.cwiseProduct(n);
    strain.compliance.setZero();
    strain.compliance.diagonal() << law.moment_compliance, law.force_compliance;
    strain.by_input.topRows<3>() = law.by_input;
    strain.by_input.bottomRows<3>().setZero();
    return true;
  }
  constexpr int kMaxIterations = 30;
  constexpr double kClose = 1e-8;  // quadratic convergence: the error after such a step is below double precision
  Vector6 stiffness;
  stiffness << law.moment_compliance.cwiseInverse(), law.force_compliance.cwiseInverse();
  Vector6 load, rest;
  load << m, n;
  rest << law.curvature, Vector3d::UnitZ();
  const Vector6 ahead = strain.compliance * (load - strain.load);
  strain.u += ahead.head<3>();
  strain.v += ahead.tail<3>();
  strain.load = load;
  Matrix6 tangent;
  Eigen::LDLT<Matrix6> factors;
  for (int iteration = 0;; ++iteration) {
    Vector6 x;
    x << strain.u, strain.v;
    Vector6 residual = stiffness.cwiseProduct(x - rest) - load;
    tangent = stiffness.asDiagonal();
    for (int i = 0; i < law.tendons; ++i) {
      const Tendon tendon(law.offset[i], strain);
      residual += law.tension[i] * tendon.along;
      addStiffness(tendon, law.offset[i], law.tension[i], tangent);
    }
    factors.compute(tangent);
    const Vector6 step = factors.solve(residual);
    const double size = step.cwiseAbs().maxCoeff() / (1.0 + x.cwiseAbs().maxCoeff());
    strain.u -= step.head<3>();
    strain.v -= step.tail<3>();
    if (size < kClose)
      break;
    if (!(size < 1e6) || iteration == kMaxIterations)
      return false;
  }
  strain.compliance = factors.solve(Matrix6::Identity());
  strain.by_input.topRows<3>() = law.moment_compliance.cwiseInverse().asDiagonal() * law.by_input;
  strain.by_input.bottomRows<3>().setZero();
  for (int i = 0; i < law.tendons; ++i)
    strain.by_input.col(law.actuator[i]) -= Tendon(law.offset[i], strain).along;
  strain.by_input = strain.compliance * strain.by_input;
  return true;
}

}  // namespace tandem::kinematics::cosserat
