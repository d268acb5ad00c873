// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics_rods/two_rods_oracle.h"

#include <Eigen/LU>
#include <array>
#include <boost/numeric/odeint.hpp>

#include "kinematics/rotations.h"

namespace tandem::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using kinematics::Wrench;
using kinematics::assist::Joints;
using kinematics::assist::Pair;
using kinematics::cosserat::Section;

using RodsState = std::array<double, 18>;  // R by columns, p, n, m; n and m in the rod's frame
using Unknowns = Eigen::Matrix<double, 12, 1>;

struct Piece {
  Section section;
  double length;
  Vector3d curvature;
};

/// End of a rod and its internal wrench there, base frame, about its end.
struct End {
  Isometry3d pose;
  Wrench wrench;
};

End integrate(const Isometry3d& base, const std::vector<Piece>& pieces, const Eigen::Matrix<double, 6, 1>& clamp) {
  namespace odeint = boost::numeric::odeint;
  RodsState y;
  Eigen::Map<Matrix3d>(y.data()) = base.linear();
  Eigen::Map<Vector3d>(y.data() + 9) = base.translation();
  Eigen::Map<Vector3d>(y.data() + 12) = base.linear().transpose() * clamp.head<3>();
  Eigen::Map<Vector3d>(y.data() + 15) = base.linear().transpose() * clamp.tail<3>();
  for (const Piece& piece : pieces) {
    if (!(piece.length > 0.0))
      continue;
    const auto equations = [&piece](const RodsState& at, RodsState& slope, double) {
      const Eigen::Map<const Matrix3d> r(at.data());
      const Eigen::Map<const Vector3d> n(at.data() + 12), m(at.data() + 15);
      const Vector3d v = Vector3d::UnitZ() + n.cwiseQuotient(piece.section.force_stiffness);
      const Vector3d u = piece.curvature + m.cwiseQuotient(piece.section.moment_stiffness);
      Eigen::Map<Matrix3d>(slope.data()) = r * kinematics::skew(u);
      Eigen::Map<Vector3d>(slope.data() + 9) = r * v;
      Eigen::Map<Vector3d>(slope.data() + 12) = -u.cross(n);
      Eigen::Map<Vector3d>(slope.data() + 15) = -u.cross(m) - v.cross(n);
    };
    odeint::integrate_adaptive(odeint::make_controlled(1e-12, 1e-12, odeint::runge_kutta_dopri5<RodsState>()),
                               equations, y, 0.0, piece.length, 0.05 * piece.length);
  }
  End end;
  end.pose.linear() = Eigen::Map<Matrix3d>(y.data());
  end.pose.translation() = Eigen::Map<Vector3d>(y.data() + 9);
  end.wrench << end.pose.linear() * Eigen::Map<Vector3d>(y.data() + 12),
      end.pose.linear() * Eigen::Map<Vector3d>(y.data() + 15);
  return end;
}

/// The wrench about another point.
Wrench about(const Wrench& wrench, const Vector3d& from, const Vector3d& to) {
  Wrench result = wrench;
  result.tail<3>() += (from - to).cross(wrench.head<3>());
  return result;
}

struct Both {
  End target, assist;
  Isometry3d target_contact, assist_tip;
  Wrench on_target, on_assist;
};

Both shoot(const Pair& pair, const Joints& q, const Unknowns& x) {
  Both both;
  both.target = integrate(pair.target.arm.base, {{pair.target.proximal, q[0], Vector3d::Zero()}}, x.head<6>());
  const Vector3d bend = q[5] / pair.assist.arm.bending_length * Vector3d(-std::sin(q[4]), std::cos(q[4]), 0.0);
  both.assist = integrate(
      pair.assist.arm.base,
      {{pair.assist.proximal, q[3], Vector3d::Zero()}, {pair.assist.distal, pair.assist.arm.bending_length, bend}},
      x.tail<6>());
  both.target_contact = both.target.pose * pair.contact;
  both.assist_tip = both.assist.pose * pair.assist.arm.tool;
  both.on_target = about(both.target.wrench, both.target.pose.translation(), both.target_contact.translation());
  both.on_assist = about(both.assist.wrench, both.assist.pose.translation(), both.assist_tip.translation());
  return both;
}

Unknowns conditions(const Pair& pair, const Both& both, double force, double length) {
  Unknowns r;
  r.head<3>() = (both.assist_tip.translation() - both.target_contact.translation()) / length;
  const Vector3d turn = kinematics::logarithm(both.assist_tip.linear() * both.target_contact.linear().transpose());
  const bool rigid = pair.type == kinematics::grasp::ContactType::kRigid;
  r.segment<3>(3) = rigid ? turn : Vector3d(both.on_target.tail<3>() / (force * length));
  r.segment<3>(6) = (both.on_target + both.on_assist).head<3>() / force;
  r.segment<3>(9) =
      (rigid ? Vector3d((both.on_target + both.on_assist).tail<3>()) : Vector3d(both.on_assist.tail<3>())) /
      (force * length);
  return r;
}

}  // namespace

TwoRodsOracle::TwoRodsOracle(const Pair& pair, const Joints& q, const kinematics::assist::ChainBranch& near) {
  const double length = 0.1, moment = pair.target.proximal.moment_stiffness.x() / length, force = moment / length;
  Unknowns unit, x;
  unit << Vector3d::Constant(force), Vector3d::Constant(moment), Vector3d::Constant(force), Vector3d::Constant(moment);
  x << near.wrench.head<3>(), near.target_moment, -near.wrench.head<3>(), near.assist_moment;
  x *= 1.02;  // beside the answer
  for (int iteration = 0; iteration < 12; ++iteration) {
    const Unknowns r = conditions(pair, shoot(pair, q, x), force, length);
    if (r.norm() < 1e-11)
      break;
    Eigen::Matrix<double, 12, 12> jacobian;
    for (int k = 0; k < 12; ++k) {
      const Unknowns step = 1e-5 * unit[k] * Unknowns::Unit(k);
      jacobian.col(k) = (conditions(pair, shoot(pair, q, x + step), force, length) -
                         conditions(pair, shoot(pair, q, x - step), force, length)) /
                        1e-5 / 2.0;
    }
    x -= unit.cwiseProduct(jacobian.partialPivLu().solve(r));
  }
  const Both both = shoot(pair, q, x);
  gap = (both.assist_tip.translation() - both.target_contact.translation()).norm();
  force_on_target = both.on_target;
  force_on_assist = both.on_assist;
  Isometry3d distal;
  Eigen::Matrix<double, 6, 1> by_bend;
  kinematics::catheter::ConstantCurvature::distal(pair.target.arm, q[2], distal, by_bend);
  tip = both.target.pose * Eigen::AngleAxisd(q[1], Vector3d::UnitZ()) * distal;
}

}  // namespace tandem::test
