// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics/boundary_value_oracle.h"

#include <algorithm>
#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <vector>

#include "tests/unit/kinematics/helix_oracle.h"

namespace tandem::test {
namespace {

namespace odeint = boost::numeric::odeint;
using kinematics::TubeSection;

constexpr int kTubes = kinematics::kMaxTubes;
// Position, frame of tube 1 by columns, its angle in the torsion-free frame, theta_i and u_iz of each tube.
constexpr int kFrame = 3, kAngle = 12, kTheta = 13, kRate = kTheta + kTubes;
using State = std::array<double, kRate + kTubes>;

/// The section of a tube at s, null beyond its end.
const TubeSection* sectionAt(const kinematics::Tube& tube, double beta, double s) {
  double end = beta;
  for (const TubeSection& section : tube.sections) {
    end += section.length;
    if (s < end)
      return &section;
  }
  return nullptr;
}

/// Twist of a tube per moment between its motor and the entry point, rad / (N m).
double transmissionCompliance(const kinematics::Tube& tube, double beta) {
  double compliance = 0.0, begin = beta;
  for (const TubeSection& section : tube.sections) {
    const double end = begin + section.length;
    if (begin < 0.0)
      compliance += (std::min(end, 0.0) - begin) / section.torsional_stiffness;
    begin = end;
  }
  return compliance;
}

/// Rucker, Jones and Webster 2010, equations (28) to (32), stiffness constant over the interval, in
/// frames of the tubes with the precurvature (0, kappa_i, tau_i): x_(kRate + i) = u_iz - tau_i.
struct Interval {
  std::array<const TubeSection*, kTubes> tube{};
  double stiffness = 0.0;
  Eigen::Vector3d force, moment, at;  ///< constant internal force; internal moment at the point `at`

  void operator()(const State& x, State& dx, double /*s*/) const {
    const Eigen::Map<const Eigen::Vector3d> p(x.data());
    const Eigen::Map<const Eigen::Matrix3d> frame(x.data() + kFrame);
    const Eigen::Vector3d load = frame.transpose() * (moment + (at - p).cross(force));
    Eigen::Vector3d u(load.x(), load.y(), 0.0);
    for (int i = 0; i < kTubes; ++i) {
      if (tube[i]) {
        const double b = tube[i]->bending_stiffness * tube[i]->curvature;
        u.x() -= b * std::sin(x[kTheta + i]);
        u.y() += b * std::cos(x[kTheta + i]);
      }
    }
    u /= stiffness;
    u.z() = x[kRate] + tube[0]->helix_torsion;
    dx.fill(0.0);
    Eigen::Map<Eigen::Vector3d>(dx.data()) = frame.col(2);
    for (int j = 0; j < 3; ++j)  // R' = R [u]x
      Eigen::Map<Eigen::Vector3d>(dx.data() + kFrame + 3 * j) = frame * u.cross(Eigen::Vector3d::Unit(j));
    dx[kAngle] = u.z();
    for (int i = 0; i < kTubes; ++i) {
      if (!tube[i])
        continue;
      const double u_ix = u.x() * std::cos(x[kTheta + i]) + u.y() * std::sin(x[kTheta + i]);
      dx[kTheta + i] = x[kRate + i] + tube[i]->helix_torsion - u.z();
      dx[kRate + i] = tube[i]->bending_stiffness / tube[i]->torsional_stiffness * u_ix * tube[i]->curvature;
    }
  }
};

std::vector<double> breakpoints(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q) {
  std::vector<double> s{0.0};
  double last = q[0];  // summed as below, so that rounding leaves no tiny interval at its end
  for (const TubeSection& section : arm.tubes[0].sections)
    last += section.length;
  for (int i = 0; i < arm.tubeCount(); ++i) {
    double end = q[i];
    for (const TubeSection& section : arm.tubes[i].sections) {
      end += section.length;
      if (end > 0.0 && end < last)
        s.push_back(end);
    }
  }
  s.push_back(last);
  std::sort(s.begin(), s.end());
  s.erase(std::unique(s.begin(), s.end()), s.end());
  return s;
}

void integrate(const Interval& interval, State& x, double begin, double end) {
  using Stepper = odeint::runge_kutta_fehlberg78<State>;
  const auto stepper = odeint::make_controlled<Stepper>(1e-13, 1e-13);
  odeint::integrate_adaptive(stepper, interval, x, begin, end, (end - begin) / 2.0);
}

}  // namespace

BoundaryValueOracle::Shot BoundaryValueOracle::shoot(const Eigen::VectorXd& q,
                                                     const Eigen::VectorXd& unknown,
                                                     const Eigen::Matrix<double, 6, 1>& wrench) const {
  const int n = arm_.tubeCount();
  const Eigen::Matrix3d to_arm = arm_.base.linear().transpose();
  Interval interval;
  interval.force = to_arm * wrench.head<3>();
  interval.moment = to_arm * wrench.tail<3>();
  interval.at = unknown.tail<3>();
  Shot shot;
  shot.residual = Eigen::VectorXd::Zero(n + 3);
  Solution& solution = shot.solution;
  solution.moment.resize(n);
  solution.end_angle = q.tail(n);
  State x{};
  std::vector<double> psi(n);
  for (int i = 0; i < n; ++i) {
    const TubeSection* entry = sectionAt(arm_.tubes[i], q[i], 0.0);
    solution.moment[i] = entry ? unknown[i] * entry->torsional_stiffness : 0.0;
    x[kRate + i] = entry ? unknown[i] : 0.0;
    psi[i] = q[n + i] + solution.moment[i] * transmissionCompliance(arm_.tubes[i], q[i]);
    psi[i] += turnBehindEntry(arm_.tubes[i], q[i]);
    x[kTheta + i] = psi[i] - psi[0];
    solution.end_angle[i] = psi[i];
    if (!entry)
      shot.residual[i] = unknown[i];
  }
  Eigen::Map<Eigen::Matrix3d> frame(x.data() + kFrame);
  frame = Eigen::AngleAxisd(psi[0], Eigen::Vector3d::UnitZ()).toRotationMatrix();
  x[kAngle] = psi[0];
  const std::vector<double> s = breakpoints(arm_, q);
  for (std::size_t k = 1; k < s.size(); ++k) {
    const auto before = interval.tube;
    interval.stiffness = 0.0;
    for (int i = 0; i < n; ++i) {
      interval.tube[i] = sectionAt(arm_.tubes[i], q[i], s[k - 1]);
      if (k > 1 && before[i] && interval.tube[i])
        x[kRate + i] *= before[i]->torsional_stiffness / interval.tube[i]->torsional_stiffness;
      if (interval.tube[i])
        interval.stiffness += interval.tube[i]->bending_stiffness;
      if (k > 1 && before[i] && !interval.tube[i]) {
        shot.residual[i] = x[kRate + i];
        solution.end_angle[i] = x[kTheta + i] + x[kAngle];
      }
    }
    integrate(interval, x, s[k - 1], s[k]);
  }
  for (int i = 0; i < n; ++i) {
    if (interval.tube[i]) {
      shot.residual[i] = x[kRate + i];
      solution.end_angle[i] = x[kTheta + i] + x[kAngle];
    }
  }
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.translation() = Eigen::Map<Eigen::Vector3d>(x.data());
  end.linear() = frame;
  const Eigen::Isometry3d tip = end * arm_.tool;
  const Eigen::Vector3d end_moment =
      interval.moment + (tip.translation() - end.translation()).cross(interval.force);  // N m
  shot.residual[0] -= end.linear().col(2).dot(end_moment) / interval.tube[0]->torsional_stiffness;
  shot.residual.tail<3>() = tip.translation() - interval.at;
  solution.tip = arm_.base * tip;
  solution.residual = shot.residual.cwiseAbs().maxCoeff();
  return shot;
}

BoundaryValueOracle::Solution BoundaryValueOracle::solve(const Eigen::VectorXd& q,
                                                         const Eigen::VectorXd& guess,
                                                         const Eigen::Matrix<double, 6, 1>& wrench,
                                                         const Eigen::Vector3d& tool_tip) const {
  const int n = arm_.tubeCount();
  Eigen::VectorXd unknown(n + 3);
  for (int i = 0; i < n; ++i) {
    const TubeSection* entry = sectionAt(arm_.tubes[i], q[i], 0.0);
    unknown[i] = entry ? guess[i] / entry->torsional_stiffness : 0.0;
  }
  unknown.tail<3>() = arm_.base.inverse() * tool_tip;
  Shot shot = shoot(q, unknown, wrench);
  for (int iteration = 0; iteration < 12 && shot.solution.residual > 1e-11; ++iteration) {
    Eigen::MatrixXd slope(n + 3, n + 3);
    for (int j = 0; j < n + 3; ++j) {
      const double h = j < n ? 1e-5 : 1e-6;
      Eigen::VectorXd moved = unknown;
      moved[j] += h;
      slope.col(j) = (shoot(q, moved, wrench).residual - shot.residual) / h;
    }
    unknown -= slope.partialPivLu().solve(shot.residual);
    Shot next = shoot(q, unknown, wrench);
    const bool better = next.solution.residual < shot.solution.residual;
    shot = next;
    if (!better && shot.solution.residual < 1e-9)
      break;
  }
  shot.solution.converged = shot.solution.residual < 1e-8;
  return shot.solution;
}

}  // namespace tandem::test
