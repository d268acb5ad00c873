// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics_rods/tendon_oracle.h"

#include <Eigen/LU>
#include <array>
#include <boost/numeric/odeint.hpp>

#include "kinematics/rotations.h"

namespace tandem::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using kinematics::skew;
using kinematics::cosserat::Actuator;
using kinematics::cosserat::Rod;
using kinematics::cosserat::RodInput;

/// R by columns, p, v, u.
using State = std::array<double, 18>;

struct Strains {
  explicit Strains(const State& y) : r(y.data()), v(y.data() + 12), u(y.data() + 15) {}
  Eigen::Map<const Matrix3d> r;
  Eigen::Map<const Vector3d> v, u;
};

class Equations {
 public:
  Equations(const Rod& rod, const RodInput& input, std::size_t k) : rod_(rod), input_(input), k_(k) {
    intrinsic_ = rod.sections[k].intrinsic_curvature;
    for (std::size_t i = 0; i < rod.actuators.size(); ++i) {
      const Actuator& actuator = rod.actuators[i];
      if (actuator.kind == Actuator::kCurvature && actuator.section == static_cast<int>(k))
        intrinsic_ += input.inputs[static_cast<Eigen::Index>(i)] * actuator.vector;
    }
  }
  Vector3d rodForce(const Strains& at) const {
    return rod_.sections[k_].force_stiffness.cwiseProduct(at.v - Vector3d::UnitZ());
  }
  Vector3d rodMoment(const Strains& at) const {
    return rod_.sections[k_].moment_stiffness.cwiseProduct(at.u - intrinsic_);
  }

  void operator()(const State& y, State& dy, double) const {
    const Strains at(y);
    Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
    Matrix3d A = Matrix3d::Zero(), B = A, G = A, H = A;
    for (std::size_t i = 0; i < rod_.actuators.size(); ++i) {
      if (rod_.actuators[i].kind != Actuator::kTendon || rod_.actuators[i].section < static_cast<int>(k_))
        continue;
      const Vector3d r = rod_.actuators[i].vector, along = at.u.cross(r) + at.v;
      const double tension = input_.inputs[static_cast<Eigen::Index>(i)];
      const Matrix3d Ai = -tension / std::pow(along.norm(), 3) * skew(along) * skew(along), Bi = skew(r) * Ai;
      A += Ai;
      B += Bi;
      G -= Ai * skew(r);
      H -= Bi * skew(r);
      a += Ai * at.u.cross(along);
      b += Bi * at.u.cross(along);
    }
    Eigen::Matrix<double, 6, 6> matrix;
    matrix << A, G, B, H;
    matrix.diagonal().head<3>() += rod_.sections[k_].force_stiffness;
    matrix.diagonal().tail<3>() += rod_.sections[k_].moment_stiffness;
    Eigen::Matrix<double, 6, 1> right;
    right << -at.u.cross(rodForce(at)) - at.r.transpose() * input_.force[k_] - a,
        -at.u.cross(rodMoment(at)) - at.v.cross(rodForce(at)) - at.r.transpose() * input_.moment[k_] - b;
    Eigen::Map<Matrix3d>(dy.data()) = at.r * skew(at.u);
    Eigen::Map<Vector3d>(dy.data() + 9) = at.r * at.v;
    Eigen::Map<Eigen::Matrix<double, 6, 1>>(dy.data() + 12) = matrix.partialPivLu().solve(right);
  }

 private:
  const Rod& rod_;
  const RodInput& input_;
  std::size_t k_;
  Vector3d intrinsic_;
};

}  // namespace

TendonOracle::TendonOracle(const Rod& rod, const RodInput& input, const kinematics::cosserat::RodPoint& clamp) {
  namespace odeint = boost::numeric::odeint;
  State y;
  Eigen::Map<Matrix3d>(y.data()) = clamp.pose.linear();
  Eigen::Map<Vector3d>(y.data() + 9) = clamp.pose.translation();
  Eigen::Map<Vector3d>(y.data() + 12) = clamp.stretch;
  Eigen::Map<Vector3d>(y.data() + 15) = clamp.curvature;
  for (std::size_t k = 0; k < rod.sections.size(); ++k) {
    const Equations equations(rod, input, k);
    const double length = k == 0 ? input.first_length : rod.sections[k].length;
    odeint::integrate_adaptive(odeint::make_controlled(1e-11, 1e-11, odeint::runge_kutta_dopri5<State>()), equations, y,
                               0.0, length, 0.01 * length);
    // Internal wrench of the rod without the point loads of tendons that end here.
    const Strains at(y);
    Vector3d force = equations.rodForce(at), moment = equations.rodMoment(at);
    for (std::size_t i = 0; i < rod.actuators.size(); ++i) {
      const Actuator& actuator = rod.actuators[i];
      if (actuator.kind != Actuator::kTendon || actuator.section != static_cast<int>(k))
        continue;
      const Vector3d along = (at.u.cross(actuator.vector) + at.v).normalized();
      force += input.inputs[static_cast<Eigen::Index>(i)] * along;
      moment += input.inputs[static_cast<Eigen::Index>(i)] * actuator.vector.cross(along);
    }
    if (k + 1 < rod.sections.size()) {
      // Continuing tendons change their direction with the strains: fixed-point iteration.
      const Equations next(rod, input, k + 1);
      State guess = y;
      for (int iteration = 0; iteration < 200; ++iteration) {
        Vector3d to_force = force, to_moment = moment;
        for (std::size_t i = 0; i < rod.actuators.size(); ++i) {
          const Actuator& actuator = rod.actuators[i];
          if (actuator.kind != Actuator::kTendon || actuator.section <= static_cast<int>(k))
            continue;
          const double tension = input.inputs[static_cast<Eigen::Index>(i)];
          const Vector3d before = (at.u.cross(actuator.vector) + at.v).normalized();
          const Strains there(guess);
          const Vector3d behind = (there.u.cross(actuator.vector) + there.v).normalized();
          to_force += tension * (before - behind);
          to_moment += tension * actuator.vector.cross(before - behind);
        }
        State zero = guess;
        Eigen::Map<Vector3d>(zero.data() + 12) = Vector3d::UnitZ();
        Eigen::Map<Vector3d>(zero.data() + 15).setZero();
        const Vector3d rest = -next.rodMoment(Strains(zero)).cwiseQuotient(rod.sections[k + 1].moment_stiffness);
        Eigen::Map<Vector3d>(guess.data() + 12) =
            Vector3d::UnitZ() + to_force.cwiseQuotient(rod.sections[k + 1].force_stiffness);
        Eigen::Map<Vector3d>(guess.data() + 15) = rest + to_moment.cwiseQuotient(rod.sections[k + 1].moment_stiffness);
      }
      y = guess;
    } else {
      const Eigen::Isometry3d& tool = rod.tool;
      pose.linear() = at.r;
      pose.translation() = Eigen::Map<Vector3d>(y.data() + 9);
      const Vector3d tip_force = at.r.transpose() * input.tip.head<3>();
      left_force = force - tip_force;
      left_moment = moment - at.r.transpose() * input.tip.tail<3>() - tool.translation().cross(tip_force);
    }
  }
}

}  // namespace tandem::test
