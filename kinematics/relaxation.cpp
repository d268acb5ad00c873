// SPDX-License-Identifier: Apache-2.0
#include "kinematics/detail/relaxation.h"

#include <algorithm>
#include <cmath>

namespace tandem::kinematics {
namespace {

/// Largest number of elements of equal length in total; more if intervals are shorter.
constexpr int kElements = 48;
constexpr int kMaxNodes = kElements + Segmentation::kMaxIntervals + 1;
constexpr int kMaxIterations = 200;
/// In units of weight(): near a bifurcation the energy is almost flat.
constexpr double kLeastDamping = 1e-5;
using Vector = TubeVector;
using Square = Eigen::Matrix<double, kMaxTubes, kMaxTubes>;
/// Intervals shorter than this are ignored; the boundary value solver corrects the error, m.
constexpr double kSliver = 1e-9;

/** Finite elements: node 0 is the entry point, element k is between nodes k and k + 1. */
class Energy {
 public:
  using Nodes = std::array<Vector, kMaxNodes>;

  Energy(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q)
      : tubes_(arm.tubeCount()), alpha_(Vector::Zero()), base_stiffness_(Vector::Ones()) {
    alpha_.head(tubes_) = q.tail(tubes_);
    length_ = parts.length();
    const double longest = length_ / kElements;
    for (int k = 0; k < parts.count; ++k) {
      const Segmentation::Interval& interval = parts.interval[k];
      const double length = interval.end - interval.start;
      if (length <= kSliver)
        continue;
      const int pieces = std::max(1, static_cast<int>(std::ceil(length / longest - 1e-9)));
      for (int j = 0; j < pieces; ++j)
        element_[count_++] = makeElement(arm, interval, length / pieces);
    }
    for (int i = 0; i < tubes_; ++i) {
      base_stiffness_[i] = 1.0 / std::max(transmissionCompliance(arm.tubes[i], q[i]), 1e-6);
      alpha_[i] += arm.tubes[i].helixAngle(-q[i]);
    }
  }

  int nodes() const { return count_ + 1; }

  /// Angles, from the ends inwards, that satisfy the equilibrium except at the motors.
  void shoot(const Vector& theta, Nodes& psi) const {
    Vector moment = Vector::Zero();
    psi[count_] = theta;
    for (int k = count_ - 1; k >= 0; --k) {
      const Element& element = element_[k];
      const Vector half = torque(element, psi[k + 1]) * (0.5 * element.length);
      moment -= half;
      psi[k] = psi[k + 1] - moment.cwiseProduct(element.compliance) - element.helix;
      moment -= torque(element, psi[k]) * (0.5 * element.length);
    }
  }

  double value(const Nodes& psi) const {
    double sum = 0.5 * (psi[0] - alpha_).cwiseAbs2().dot(base_stiffness_);
    for (int k = 0; k < count_; ++k) {
      const Element& element = element_[k];
      const Vector twist = psi[k + 1] - psi[k] - element.helix, middle = 0.5 * (psi[k] + psi[k + 1]);
      sum += 0.5 * twist.cwiseAbs2().dot(element.stiffness) -
             0.5 * element.length / element.total * bend(element, middle).squaredNorm();
    }
    return sum;
  }

  /// Gradient, diagonal and upper off-diagonal blocks of the Hessian. Nodes beyond a tube's end get a unit diagonal.
  void derivatives(const Nodes& psi,
                   Nodes& gradient,
                   std::array<Square, kMaxNodes>& diagonal,
                   std::array<Square, kMaxNodes>& upper) const {
    gradient[0] = (psi[0] - alpha_).cwiseProduct(base_stiffness_);
    diagonal[0] = base_stiffness_.asDiagonal();
    for (int k = 0; k < count_; ++k) {
      const Element& element = element_[k];
      const Vector stretch = (psi[k + 1] - psi[k] - element.helix).cwiseProduct(element.stiffness);
      const Vector middle = 0.5 * (psi[k] + psi[k + 1]);
      const Vector half = 0.5 * element.length * torque(element, middle);
      const Square quarter = 0.25 * element.length * torqueByPsi(element, middle);
      const Square stiffness = element.stiffness.asDiagonal();
      gradient[k] += half - stretch;
      gradient[k + 1] = half + stretch;
      diagonal[k] += stiffness + quarter;
      diagonal[k + 1] = stiffness + quarter;
      upper[k] = quarter - stiffness;
      for (int i = 0; i < kMaxTubes; ++i) {
        if (element.stiffness[i] == 0.0)
          diagonal[k + 1](i, i) = 1.0;
      }
    }
  }

  /// Damping weight of the angle of tube i at node k: its share of c_i / L, so that damping does not depend on the
  /// elements' lengths.
  Vector weight(int k) const {
    Vector sum = Vector::Zero();
    for (int j = std::max(0, k - 1); j < std::min(k + 1, count_); ++j)
      sum += 0.5 * element_[j].stiffness * (element_[j].length * element_[j].length / (length_ * length_));
    return sum;
  }

  /// End angles: psi at the last node of each tube.
  Vector ends(const Nodes& psi) const {
    Vector theta = psi[0];
    for (int k = 0; k < count_; ++k) {
      for (int i = 0; i < kMaxTubes; ++i) {
        if (element_[k].stiffness[i] > 0.0)
          theta[i] = psi[k + 1][i];
      }
    }
    return theta;
  }

 private:
  struct Element {
    double length = 0.0;
    double total = 0.0;                  ///< K, N m^2
    Vector b = Vector::Zero();           ///< K_i kappa_i, N m
    Vector stiffness = Vector::Zero();   ///< c_i / length, 0 where the tube has ended
    Vector compliance = Vector::Zero();  ///< length / c_i, 0 where it has ended
    Vector helix = Vector::Zero();       ///< tau_i length, rad
  };

  Element makeElement(const ConcentricTubeArm& arm, const Segmentation::Interval& interval, double length) const {
    Element element;
    element.length = length;
    for (int i = 0; i < tubes_; ++i) {
      if (interval.section[i] == Segmentation::kAbsent)
        continue;
      const TubeSection& section = arm.tubes[i].sections[interval.section[i]];
      element.total += section.bending_stiffness;
      element.b[i] = section.bending_stiffness * section.curvature;
      element.stiffness[i] = section.torsional_stiffness / length;
      element.compliance[i] = length / section.torsional_stiffness;
      element.helix[i] = section.helix_torsion * length;
    }
    return element;
  }

  static double transmissionCompliance(const Tube& tube, double beta) {
    double compliance = 0.0, s = beta;
    for (const TubeSection& section : tube.sections) {
      compliance += std::max(0.0, std::min(section.length, -s)) / section.torsional_stiffness;
      s += section.length;
    }
    return compliance;
  }

  /// sum_i b_i exp(i psi_i) as a vector, N m.
  static Eigen::Vector2d bend(const Element& element, const Vector& psi) {
    return {element.b.dot(psi.array().cos().matrix()), element.b.dot(psi.array().sin().matrix())};
  }
  /// d t_i / ds in equilibrium, N.
  static Vector torque(const Element& element, const Vector& psi) {
    const Eigen::Vector2d sum = bend(element, psi) / element.total;
    return element.b.array() * (psi.array().sin() * sum.x() - psi.array().cos() * sum.y());
  }
  static Square torqueByPsi(const Element& element, const Vector& psi) {
    const Eigen::Vector2d sum = bend(element, psi) / element.total;
    const Vector c = element.b.array() * psi.array().cos(), s = element.b.array() * psi.array().sin();
    Square result = -(c * c.transpose() + s * s.transpose()) / element.total;
    result.diagonal() += c * sum.x() + s * sum.y();
    return result;
  }

  int tubes_;
  Vector alpha_;           ///< directions of bending at the entry point if the transmission did not twist
  Vector base_stiffness_;  ///< 1 / F_i, N m / rad
  std::array<Element, kMaxNodes> element_;
  int count_ = 0;
  double length_ = 0.0;
};

/// Solves the block tridiagonal (H + damping) x = -gradient by Cholesky's method. False: not positive definite.
bool solveTridiagonal(std::array<Square, kMaxNodes>& diagonal,
                      const std::array<Square, kMaxNodes>& upper,
                      std::array<Vector, kMaxNodes>& x,
                      int nodes) {
  Eigen::LLT<Square> factor;
  std::array<Square, kMaxNodes> eliminated;
  for (int k = 0; k < nodes; ++k) {
    if (k > 0) {
      diagonal[k] -= upper[k - 1].transpose() * eliminated[k - 1];
      x[k] -= upper[k - 1].transpose() * x[k - 1];
    }
    factor.compute(diagonal[k]);
    if (factor.info() != Eigen::Success)
      return false;
    x[k] = factor.solve(x[k]).eval();
    if (k + 1 < nodes)
      eliminated[k] = factor.solve(upper[k]);
  }
  for (int k = nodes - 2; k >= 0; --k)
    x[k] -= eliminated[k] * x[k + 1];
  return true;
}

}  // namespace

bool relax(const ConcentricTubeArm& arm,
           const Segmentation& parts,
           const JointsRef& q,
           const TubeVector& nudge,
           TubeVector& theta) noexcept {
  const Energy energy(arm, parts, q);
  Energy::Nodes psi, step, trial;
  std::array<Square, kMaxNodes> diagonal, upper;
  energy.shoot(theta, psi);
  for (int k = 0; k < energy.nodes(); ++k)
    psi[k] += nudge * ((k + 1.0) / energy.nodes());
  double value = energy.value(psi), damping = 0.0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    energy.derivatives(psi, step, diagonal, upper);
    for (int k = 0; k < energy.nodes(); ++k) {
      step[k] = -step[k];
      diagonal[k].diagonal() += damping * energy.weight(k);
    }
    double largest = 0.0;
    bool down = solveTridiagonal(diagonal, upper, step, energy.nodes());
    for (int k = 0; down && k < energy.nodes(); ++k) {
      largest = std::max(largest, step[k].cwiseAbs().maxCoeff());
      trial[k] = psi[k] + step[k];
    }
    // Short steps, so that the descent does not cross a ridge into another valley.
    constexpr double kLongest = 0.3;
    const double trial_value = down && largest < kLongest ? energy.value(trial) : 0.0;
    down = down && largest < kLongest && trial_value <= value + 1e-14 * std::abs(value);
    if (!down) {
      damping = std::max(4.0 * damping, kLeastDamping);
      continue;
    }
    psi = trial;
    value = trial_value;
    if (largest < 1e-7 && damping == 0.0) {
      theta = energy.ends(psi);
      return true;
    }
    damping = damping <= kLeastDamping ? 0.0 : 0.25 * damping;
  }
  return false;
}

}  // namespace tandem::kinematics
