// SPDX-License-Identifier: Apache-2.0
#include "bench/shooting_baseline.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>

namespace tandem::bench {
namespace {

namespace odeint = boost::numeric::odeint;
constexpr int kTubes = kinematics::kMaxTubes, kFrame = 3, kTheta = 12, kRate = kTheta + kTubes;
using State = std::array<double, kRate + kTubes>;

struct Interval {
  std::array<const kinematics::TubeSection*, kTubes> tube{};

  void operator()(const State& x, State& dx, double /*s*/) const {
    const Eigen::Map<const Eigen::Matrix3d> frame(x.data() + kFrame);
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    double stiffness = 0.0;
    for (int i = 0; i < kTubes; ++i) {
      if (!tube[i])
        continue;
      const double b = tube[i]->bending_stiffness * tube[i]->curvature;
      stiffness += tube[i]->bending_stiffness;
      u.x() -= b * std::sin(x[kTheta + i]);
      u.y() += b * std::cos(x[kTheta + i]);
    }
    u /= stiffness;
    u.z() = x[kRate];
    dx.fill(0.0);
    Eigen::Map<Eigen::Vector3d>(dx.data()) = frame.col(2);
    for (int j = 0; j < 3; ++j)
      Eigen::Map<Eigen::Vector3d>(dx.data() + kFrame + 3 * j) = frame * u.cross(Eigen::Vector3d::Unit(j));
    for (int i = 0; i < kTubes; ++i) {
      if (!tube[i])
        continue;
      dx[kTheta + i] = x[kRate + i] - x[kRate];
      dx[kRate + i] = tube[i]->bending_stiffness / tube[i]->torsional_stiffness * tube[i]->curvature *
                      (u.x() * std::cos(x[kTheta + i]) + u.y() * std::sin(x[kTheta + i]));
    }
  }
};

const kinematics::TubeSection* sectionAt(const kinematics::Tube& tube, double beta, double s) {
  for (const auto& section : tube.sections) {
    beta += section.length;
    if (s < beta)
      return &section;
  }
  return nullptr;
}

}  // namespace

/// @return u_iz at the tubes' ends, which is zero in the solution. Assumes one torsional stiffness for all sections of
/// a tube.
Eigen::VectorXd ShootingBaseline::shoot(const Eigen::VectorXd& q,
                                        const Eigen::VectorXd& twist_rate,
                                        Eigen::Isometry3d& pose) const {
  const int n = arm_.tubeCount();
  std::vector<double> places{0.0};
  const double last = q[0] + arm_.tubes[0].length();
  for (int i = 0; i < n; ++i) {
    double s = q[i];
    for (const auto& section : arm_.tubes[i].sections) {
      if ((s += section.length) > 0.0 && s <= last)
        places.push_back(s);
    }
  }
  std::sort(places.begin(), places.end());
  State x{};
  double first = 0.0;
  for (int i = 0; i < n; ++i) {
    const double psi = q[n + i] - q[i] * twist_rate[i];
    first = i == 0 ? psi : first;
    x[kTheta + i] = psi - first;
    x[kRate + i] = twist_rate[i];
  }
  Eigen::Map<Eigen::Matrix3d> frame(x.data() + kFrame);
  frame = Eigen::AngleAxisd(first, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto stepper = odeint::make_controlled<odeint::runge_kutta_dopri5<State>>(1e-9, 1e-9);
  for (std::size_t k = 1; k < places.size(); ++k) {
    const double length = places[k] - places[k - 1];
    if (length <= 0.0)
      continue;
    Interval interval;
    for (int i = 0; i < n; ++i)
      interval.tube[i] = sectionAt(arm_.tubes[i], q[i], places[k - 1]);
    odeint::integrate_adaptive(stepper, interval, x, places[k - 1], places[k], length);
  }
  pose.translation() = Eigen::Map<Eigen::Vector3d>(x.data());
  pose.linear() = frame;
  pose = arm_.base * pose * arm_.tool;
  return Eigen::Map<Eigen::VectorXd>(x.data() + kRate, n);
}

bool ShootingBaseline::solve(const Eigen::VectorXd& q, Eigen::VectorXd& twist_rate, Eigen::Isometry3d& pose) const {
  const int n = arm_.tubeCount();
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Eigen::VectorXd residual = shoot(q, twist_rate, pose);
    if (residual.cwiseAbs().maxCoeff() < 1e-6)
      return true;
    Eigen::MatrixXd slope(n, n);
    Eigen::Isometry3d unused = Eigen::Isometry3d::Identity();
    for (int j = 0; j < n; ++j) {
      Eigen::VectorXd moved = twist_rate;
      moved[j] += 1e-5;
      slope.col(j) = (shoot(q, moved, unused) - residual) / 1e-5;
    }
    twist_rate -= slope.partialPivLu().solve(residual);
  }
  return false;
}

bool ShootingBaseline::tip(const Eigen::VectorXd& q, Eigen::VectorXd& twist_rate, kinematics::Tip& tip) const {
  if (!solve(q, twist_rate, tip.pose))
    return false;
  tip.jacobian.resize(6, q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double h = 1e-5;
    Eigen::VectorXd moved = q, rate = twist_rate;
    moved[j] -= h;  // a forward step of a translation might leave the valid range
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    if (!solve(moved, rate, pose))
      return false;
    const Eigen::AngleAxisd turn(tip.pose.linear() * pose.linear().transpose());
    tip.jacobian.col(j) << (tip.pose.translation() - pose.translation()) / h, turn.angle() * turn.axis() / h;
  }
  return true;
}

}  // namespace tandem::bench
