// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tube_loads.h"

#include <algorithm>
#include <cmath>

namespace tandem::kinematics {
namespace {

constexpr int kSteps = 48;  ///< over the arm; at least kLeastSteps in an interval
constexpr int kLeastSteps = 2;
using Plane = Eigen::Matrix<double, 2, kMaxTubes>;  ///< a vector of the cross-section for each tube

/// (y, -x): the cross product of a vector of the cross-section with the tangent.
Eigen::Vector2d turned(const Eigen::Vector2d& v) { return {v.y(), -v.x()}; }

/** Properties of the tubes in one interval; zero for absent tubes. */
struct Part {
  TubeVector bending = TubeVector::Zero();     ///< K_i
  TubeVector b = TubeVector::Zero();           ///< K_i kappa_i
  TubeVector compliance = TubeVector::Zero();  ///< 1 / c_i
  TubeVector helix = TubeVector::Zero();       ///< tau_i
  double total = 0.0;                          ///< K

  Part(const ConcentricTubeArm& arm, const Segmentation::Interval& interval, bool twist) {
    for (int i = 0; i < arm.tubeCount(); ++i) {
      if (interval.section[i] == Segmentation::kAbsent)
        continue;
      const TubeSection& section = arm.tubes[i].sections[interval.section[i]];
      bending[i] = section.bending_stiffness;
      b[i] = section.bending_stiffness * section.curvature;
      compliance[i] = twist ? 1.0 / section.torsional_stiffness : 0.0;
      helix[i] = section.helix_torsion;
    }
    total = bending.sum();
  }
};

/** Angles and torsional moments of the tubes, and what follows from them. */
struct State {
  TubeVector psi, torsion = TubeVector::Zero();
  double energy = 0.0;  ///< from the tip to here

  /// d / ds; of the energy too.
  State slope(const Part& part) const {
    State d;
    const Eigen::Vector2d u = curvature(part);
    const TubeVector twist = torsion.cwiseProduct(part.compliance);
    d.psi = twist + part.helix;
    d.torsion = part.b.array() * (u.x() * psi.array().cos() + u.y() * psi.array().sin());
    d.energy = 0.5 * twist.dot(torsion);
    const Plane m = moments(part);
    for (int i = 0; i < kMaxTubes; ++i)
      d.energy += part.bending[i] > 0.0 ? 0.5 * m.col(i).squaredNorm() / part.bending[i] : 0.0;
    return d;
  }
  State plus(double h, const State& d) const {
    State next;
    next.psi = psi + h * d.psi;
    next.torsion = torsion + h * d.torsion;
    next.energy = energy - h * d.energy;  // h < 0: inwards
    return next;
  }
  Eigen::Vector2d curvature(const Part& part) const {
    return Eigen::Vector2d(-part.b.dot(psi.array().sin().matrix()), part.b.dot(psi.array().cos().matrix())) /
           part.total;
  }
  /// m_i
  Plane moments(const Part& part) const {
    Plane m = curvature(part) * part.bending.transpose();
    m.row(0) += part.b.cwiseProduct(psi.array().sin().matrix()).transpose();
    m.row(1) -= part.b.cwiseProduct(psi.array().cos().matrix()).transpose();
    return m;
  }
  /// m_i'
  Plane momentSlopes(const Part& part) const {
    const TubeVector rate = (torsion.cwiseProduct(part.compliance) + part.helix).cwiseProduct(part.b);
    const TubeVector x = rate.cwiseProduct(psi.array().cos().matrix()),
                     y = rate.cwiseProduct(psi.array().sin().matrix());
    Plane slopes = Eigen::Vector2d(-x.sum(), -y.sum()) / part.total * part.bending.transpose();
    slopes.row(0) += x.transpose();
    slopes.row(1) += y.transpose();
    return slopes;
  }
};

/** March from the tip to the entry point. */
class Sweep {
 public:
  Sweep(const TubeVector& theta, TubeLoads& loads) : loads_(loads) { state_.psi = theta; }

  void enter(const Part& part) {
    jumpTo(state_.moments(part));
    const Plane n = shear(part);
    loads_.force += (n - shear_).colwise().norm().transpose();
    shear_ = n;
  }
  /// Integrates over `length`. @param scale length of the arm, m
  void march(const Part& part, double length, double scale) {
    const int steps = std::max(kLeastSteps, static_cast<int>(std::ceil(kSteps * length / scale)));
    const double h = length / steps;
    for (int k = 0; k < steps; ++k)
      step(part, h);
    moment_ = state_.moments(part);
  }
  /// To a straight guide, whose tubes have the moments -b_i e_i and the forces n_i = b_i tau_i e_i.
  void enterGuide(const TubeVector& b, const TubeVector& helix) {
    Plane e;
    e.row(0) = -state_.psi.array().sin().matrix().transpose();
    e.row(1) = state_.psi.array().cos().matrix().transpose();
    jumpTo(-e * b.asDiagonal());
    loads_.force += (e * b.cwiseProduct(helix).asDiagonal() - shear_).colwise().norm().transpose();
  }
  const State& state() const { return state_; }

 private:
  void jumpTo(const Plane& m) {
    loads_.couple += (m - moment_).colwise().norm().transpose();
    moment_ = m;
  }
  /// n_xy of every tube.
  Plane shear(const Part& part) const {
    const Plane g = state_.momentSlopes(part) + turned(state_.curvature(part)) * state_.torsion.transpose();
    Plane n;
    n.row(0) = -g.row(1);
    n.row(1) = g.row(0);
    return n;
  }
  TubeVector axialSlope(const Part& part) const {
    return -state_.momentSlopes(part).transpose() * state_.curvature(part);
  }
  void step(const Part& part, double h) {
    const TubeVector slope = axialSlope(part);
    const State a = state_.slope(part), b = state_.plus(-0.5 * h, a).slope(part),
                c = state_.plus(-0.5 * h, b).slope(part), d = state_.plus(-h, c).slope(part);
    state_ = state_.plus(-h / 6.0, a).plus(-h / 3.0, b).plus(-h / 3.0, c).plus(-h / 6.0, d);
    const TubeVector middle = axial_ - 0.25 * h * (slope + axialSlope(part));
    axial_ -= 0.5 * h * (slope + axialSlope(part));
    const Plane n = shear(part);
    const Plane contact = (shear_ - n) + h * turned(state_.curvature(part)) * middle.transpose();
    loads_.force += contact.colwise().norm().transpose();
    shear_ = n;
  }

  TubeLoads& loads_;
  State state_;
  Plane moment_ = Plane::Zero(), shear_ = Plane::Zero();
  TubeVector axial_ = TubeVector::Zero();  ///< n_z
};

}  // namespace

TubeLoads tubeLoads(const ConcentricTubeArm& arm,
                    const Segmentation& parts,
                    const TubeVector& beta,
                    const TubeVector& theta,
                    bool twist) noexcept {
  constexpr double kSliver = 1e-9;  // m
  TubeLoads loads;
  Sweep sweep(theta, loads);
  for (int k = parts.count - 1; k >= 0; --k) {
    const Segmentation::Interval& interval = parts.interval[k];
    if (interval.end - interval.start <= kSliver)
      continue;
    const Part part(arm, interval, twist);
    sweep.enter(part);
    sweep.march(part, interval.end - interval.start, parts.length());
  }
  loads.energy = sweep.state().energy;
  TubeVector b = TubeVector::Zero(), helix = TubeVector::Zero();  // of the section that passes the entry point
  for (int i = 0; i < arm.tubeCount(); ++i) {
    double s = beta[i], before = 0.0;
    for (const TubeSection& section : arm.tubes[i].sections) {
      const double behind = std::min(section.length, -s);
      if (behind <= kSliver)
        break;
      const double shear = b[i] * helix[i];
      b[i] = section.bending_stiffness * section.curvature;
      helix[i] = section.helix_torsion;
      loads.couple[i] += std::abs(b[i] - before);
      loads.force[i] += std::abs(b[i] * helix[i] - shear) + behind * std::abs(b[i]) * helix[i] * helix[i];
      loads.energy += 0.5 * behind * b[i] * section.curvature;
      if (twist)
        loads.energy +=
            0.5 * behind / section.torsional_stiffness * sweep.state().torsion[i] * sweep.state().torsion[i];
      before = b[i];
      s += section.length;
    }
  }
  sweep.enterGuide(b, helix);
  return loads;
}

}  // namespace tandem::kinematics
