// SPDX-License-Identifier: Apache-2.0
#include "kinematics/cosserat/sweep.h"

#include <algorithm>
#include <boost/numeric/odeint/algebra/vector_space_algebra.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cmath>
#include <limits>

#include "kinematics/cosserat/detail/strain.h"
#include "kinematics/rotations.h"

namespace tandem::kinematics::cosserat {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double lengthOf(const Rod& rod, const RodInput& input) {
  double length = input.first_length;
  for (std::size_t k = 1; k < rod.sections.size(); ++k)
    length += rod.sections[k].length;
  return length;
}

namespace {

double stiffnessUnit(const Rod& rod) {
  double unit = 0.0;
  for (const Section& section : rod.sections)
    unit = std::max(unit, section.moment_stiffness.head<2>().maxCoeff());
  return unit;
}

}  // namespace

double momentScale(const Rod& rod, const RodInput& input) { return stiffnessUnit(rod) / lengthOf(rod, input); }

namespace {

/// State: R by columns, p, m, energy, bend; then one column of (turn, moment, shift, bend) per derivative. All in units
/// of the rod's length and its largest bending stiffness, so that one tolerance applies to all.
constexpr int kPosition = 9, kMoment = 12, kEnergy = 15, kBend = 16, kBase = 17;
constexpr int kBendRow = 9, kRows = 10;
template <int kColumns>
using State = Eigen::Matrix<double, kBase + kRows * kColumns, 1>;

template <int kColumns>
auto columnsOf(State<kColumns>& y) {
  return Eigen::Map<Eigen::Matrix<double, kRows, kColumns>>(y.data() + kBase);
}
template <int kColumns>
auto columnsOf(const State<kColumns>& y) {
  return Eigen::Map<const Eigen::Matrix<double, kRows, kColumns>>(y.data() + kBase);
}
template <int kColumns>
Matrix3d rotationOf(const State<kColumns>& y) {
  return Eigen::Map<const Matrix3d>(y.data());
}

template <int kColumns>
class Integration {
 public:
  using Columns = Eigen::Matrix<double, kRows, kColumns>;

  Integration(const SweepStart& start, SweepEnd<kColumns>& end)
      : start_(start), end_(end), length_(lengthOf(start.rod, start.input)), stiffness_(stiffnessUnit(start.rod)) {}

  bool run() {
    begin();
    for (std::size_t k = 0; k < start_.rod.sections.size(); ++k) {
      enter(k);
      if (k == 0 && !baseStrain())
        return false;
      if (!cross())
        return false;
    }
    finish();
    return true;
  }

 private:
  using Stepper = boost::numeric::odeint::runge_kutta_fehlberg78<State<kColumns>,
                                                                 double,
                                                                 State<kColumns>,
                                                                 double,
                                                                 boost::numeric::odeint::vector_space_algebra>;
  static constexpr int kMaxSteps = 2000;
  static constexpr double kLongestStep = 0.5, kShortestStep = 1e-6;

  double sectionLength(std::size_t k) const {
    return k == 0 ? start_.input.first_length : start_.rod.sections[k].length;
  }

  void begin() {
    const double force_unit = stiffness_ / (length_ * length_);
    y_.setZero();
    Eigen::Map<Matrix3d>(y_.data()) = start_.input.base.linear();
    y_.template segment<3>(kMoment) = start_.base_moment * length_ / stiffness_;
    auto columns = columnsOf<kColumns>(y_);
    columns.template block<3, 3>(3, kByMoment).setIdentity();
    if constexpr (kColumns > kByTurn)
      columns.template block<3, 3>(0, kByTurn).setIdentity();
    force_ = start_.load * start_.input.tip.head<3>() / force_unit;
    for (std::size_t k = 0; k < start_.rod.sections.size(); ++k)
      force_ += start_.load * start_.input.force[k] * sectionLength(k) / force_unit;
    end_.base_force = force_unit * force_;
    if constexpr (kColumns == kAllColumns) {
      if (start_.index)
        start_.index->add(columns.template topLeftCorner<9, 9>());
    }
  }

  /// Enters section k, which begins at s_.
  void enter(std::size_t k) {
    const Section& section = start_.rod.sections[k];
    law_ = SectionLaw();
    law_.length = sectionLength(k) / length_;
    law_.moment_compliance = stiffness_ * section.moment_stiffness.cwiseInverse();
    law_.force_compliance = stiffness_ / (length_ * length_) * section.force_stiffness.cwiseInverse();
    law_.curvature = length_ * section.intrinsic_curvature;
    intrinsic_ = law_.curvature;
    axis_.setZero();
    law_.force = start_.load * start_.input.force[k] * (length_ * length_ * length_) / stiffness_;
    law_.moment = start_.load * start_.input.moment[k] * (length_ * length_) / stiffness_;
    for (std::size_t i = 0; i < start_.rod.actuators.size(); ++i) {
      const Actuator& actuator = start_.rod.actuators[i];
      const auto column = static_cast<Eigen::Index>(i);
      const int at = static_cast<int>(k);
      if (actuator.kind == Actuator::kCurvature && actuator.section == at) {
        law_.by_input.col(column) = length_ * actuator.vector;
        const double share = start_.input.wire.share[column];
        law_.curvature += (start_.input.inputs[column] + start_.pull * share) * law_.by_input.col(column);
        axis_ += share * law_.length * law_.by_input.col(column);
      } else if (actuator.kind == Actuator::kTendon && actuator.section >= at) {
        const auto t = static_cast<std::size_t>(law_.tendons++);
        law_.actuator[t] = static_cast<int>(i);
        law_.offset[t] = actuator.vector / length_;
        law_.tension[t] = start_.input.inputs[column] * (length_ * length_) / stiffness_;
      }
    }
    section_start_ = s_;
    strain_ = Strain();
    strain_.u = law_.curvature;
  }

  bool strainAt(const State<kColumns>& y, const Vector3d& n) {
    const Matrix3d r = rotationOf<kColumns>(y);
    return solveStrain(law_, r.transpose() * y.template segment<3>(kMoment), r.transpose() * n, strain_);
  }

  bool baseStrain() {
    if (!strainAt(y_, force_))
      return false;
    const Matrix3d r = rotationOf<kColumns>(y_);
    end_.base_strain << r * strain_.v, r * strain_.u / length_;
    return true;
  }

  /// Slope at s; NaN if no strain is found.
  void slope(const State<kColumns>& y, State<kColumns>& dy, double s) {
    const Vector3d n = force_ - (s - section_start_) * law_.force;
    if (!strainAt(y, n)) {
      dy.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    const Matrix3d r = rotationOf<kColumns>(y);
    const Vector3d m = y.template segment<3>(kMoment), t = r * strain_.v;
    Eigen::Map<Matrix3d>(dy.data()) = r * skew(strain_.u);
    dy.template segment<3>(kPosition) = t;
    dy.template segment<3>(kMoment) = n.cross(t) - law_.moment;
    dy[kEnergy] = energyDensity();
    dy[kBend] = axis_.dot(strain_.u - intrinsic_);

    // Change of the strains, in the base frame, with the rotation of the frame and with moment and force.
    Matrix6 world;
    if (law_.tendons == 0) {
      world.setZero();
      world.topLeftCorner<3, 3>() = r * law_.moment_compliance.asDiagonal() * r.transpose();
      world.bottomRightCorner<3, 3>() = r * law_.force_compliance.asDiagonal() * r.transpose();
    } else {
      world.topLeftCorner<3, 3>() = r * strain_.compliance.topLeftCorner<3, 3>() * r.transpose();
      world.topRightCorner<3, 3>() = r * strain_.compliance.topRightCorner<3, 3>() * r.transpose();
      world.bottomLeftCorner<3, 3>() = world.topRightCorner<3, 3>().transpose();
      world.bottomRightCorner<3, 3>() = r * strain_.compliance.bottomRightCorner<3, 3>() * r.transpose();
    }
    const Matrix3d nx = skew(n), tx = skew(t);
    Matrix6 by_frame;  // (turn', shift') by (turn, moment)
    by_frame.leftCols<3>() = world.leftCols<3>() * skew(m) + world.rightCols<3>() * nx;
    by_frame.bottomLeftCorner<3, 3>() -= tx;
    by_frame.rightCols<3>() = world.leftCols<3>();
    const auto columns = columnsOf<kColumns>(y);
    auto change = columnsOf<kColumns>(dy);
    Eigen::Matrix<double, 6, kColumns> strains;
    strains.noalias() = by_frame * columns.template topRows<6>();
    if constexpr (kColumns > kByForce)
      strains.template middleCols<3>(kByForce) += world.rightCols<3>();
    if constexpr (kColumns == kAllColumns) {
      strains.template rightCols<kMaxActuators>().template topRows<3>() += r * strain_.by_input.template topRows<3>();
      strains.template rightCols<kMaxActuators>().template bottomRows<3>() +=
          r * strain_.by_input.template bottomRows<3>();
    }
    change.template topRows<3>() = strains.template topRows<3>();
    change.template middleRows<3>(6) = strains.template bottomRows<3>();
    change.row(kBendRow).noalias() = (r * axis_).transpose() * strains.template topRows<3>();
    change.template middleRows<3>(3).noalias() = nx * strains.template bottomRows<3>();
    if constexpr (kColumns > kByForce)
      change.template block<3, 3>(3, kByForce) -= tx;
  }

  double energyDensity() const {
    const Vector3d du = strain_.u - law_.curvature, dv = strain_.v - Vector3d::UnitZ();
    return 0.5 * (du.cwiseAbs2().cwiseQuotient(law_.moment_compliance).sum() +
                  dv.cwiseAbs2().cwiseQuotient(law_.force_compliance).sum());
  }

  /// A piece shorter than this does not buckle by itself.
  double longestPiece() const {
    const Vector3d n = force_ - (s_ - section_start_) * law_.force;
    const double softness = law_.moment_compliance.maxCoeff();
    const double by_force = 1.0 / std::sqrt(std::max(softness * n.norm(), 1e-12));
    const double by_moment = 2.0 / std::max(softness * y_.template segment<3>(kMoment).norm(), 1e-12);
    return std::max({std::min({by_force, by_moment, 0.25}), kShortestStep});
  }

  bool cross() {
    const double stop = section_start_ + law_.length;
    const auto system = [this](const State<kColumns>& y, State<kColumns>& dy, double s) { slope(y, dy, s); };
    const bool fixed = start_.accuracy.fixed_steps > 0;
    if (fixed)
      step_ = law_.length / start_.accuracy.fixed_steps;
    sample(s_);
    while (s_ < stop) {
      if (++end_.steps > kMaxSteps)
        return false;
      double until = stop;
      if (start_.points && sampled_ < start_.points->size())
        until = std::clamp((*start_.points)[sampled_].s / length_, s_, stop);
      double longest = fixed ? step_ : std::min(step_, kLongestStep);
      if (start_.index)
        longest = std::min(longest, longestPiece());
      const bool reaches = longest * (1.0 + 1e-9) >= until - s_;
      const double h = reaches ? until - s_ : longest;
      stepper_.do_step(system, y_, s_, next_, h, error_);
      if (!next_.allFinite())
        return false;
      const double excess = fixed ? 0.0 : errorOf() / start_.accuracy.tolerance;
      if (excess > 1.0 && h > kShortestStep) {
        step_ = std::max(kShortestStep, h * std::max(0.2, 0.9 * std::pow(excess, -1.0 / 8.0)));
        continue;
      }
      y_ = next_;
      s_ = reaches ? until : s_ + h;
      if (!fixed)
        step_ = std::max(reaches ? step_ : 0.0, h * std::min(4.0, 0.9 * std::pow(std::max(excess, 1e-8), -1.0 / 8.0)));
      note();
    }
    force_ -= law_.length * law_.force;
    return true;
  }

  /// Without the bend, whose error is that of the turns.
  double errorOf() const {
    const double base = error_.template head<kBend>().cwiseAbs().maxCoeff();
    const double derivatives = columnsOf<kColumns>(error_).template topRows<kBendRow>().cwiseAbs().maxCoeff() /
                               (1.0 + columnsOf<kColumns>(next_).template topRows<kBendRow>().cwiseAbs().maxCoeff());
    return std::max(base, derivatives);
  }

  void note() {
    if constexpr (kColumns == kAllColumns) {
      if (start_.index)
        start_.index->add(columnsOf<kColumns>(y_).template topLeftCorner<9, 9>());
    }
    sample(s_);
  }

  void sample(double s) {
    while (start_.points && sampled_ < start_.points->size() && (*start_.points)[sampled_].s / length_ <= s + 1e-12) {
      RodPoint& point = (*start_.points)[sampled_++];
      const Vector3d n = force_ - (s_ - section_start_) * law_.force;
      strainAt(y_, n);
      point.pose.linear() = rotationOf<kColumns>(y_);
      point.pose.translation() = start_.input.base.translation() + length_ * y_.template segment<3>(kPosition);
      point.curvature = strain_.u / length_;
      point.stretch = strain_.v;
      point.force = stiffness_ / (length_ * length_) * n;
      point.moment = stiffness_ / length_ * y_.template segment<3>(kMoment);
    }
  }

  /// Converts units of the rod to SI.
  void finish() {
    const double moment = stiffness_ / length_;
    end_.pose.linear() = rotationOf<kColumns>(y_);
    end_.pose.translation() = start_.input.base.translation() + length_ * y_.template segment<3>(kPosition);
    end_.moment = moment * y_.template segment<3>(kMoment);
    end_.energy = moment * y_[kEnergy];
    Columns columns = columnsOf<kColumns>(y_);
    columns.template middleCols<3>(kByMoment) /= moment;
    if constexpr (kColumns > kByForce)
      columns.template middleCols<3>(kByForce) *= length_ / moment;
    if constexpr (kColumns == kAllColumns) {
      for (std::size_t i = 0; i < start_.rod.actuators.size(); ++i) {
        if (start_.rod.actuators[i].kind == Actuator::kTendon)
          columns.col(kByInput + static_cast<Eigen::Index>(i)) *= length_ / moment;
      }
    }
    end_.turn = columns.template topRows<3>();
    end_.by_moment = moment * columns.template middleRows<3>(3);
    end_.shift = length_ * columns.template middleRows<3>(6);
    end_.bend = y_[kBend];
    end_.bend_by = columns.row(kBendRow);
  }

  const SweepStart& start_;
  SweepEnd<kColumns>& end_;
  double length_, stiffness_;
  State<kColumns> y_, next_, error_;
  Stepper stepper_;
  SectionLaw law_;
  Strain strain_;
  Vector3d intrinsic_, axis_;  ///< curvature without actuators; axis of the wire's condition
  Vector3d force_;             ///< n at the start of the section
  double s_ = 0.0, section_start_ = 0.0, step_ = 0.25;
  std::size_t sampled_ = 0;
};

}  // namespace

template <int kColumns>
bool sweep(const SweepStart& start, SweepEnd<kColumns>& end) noexcept {
  end.steps = 0;
  return Integration<kColumns>(start, end).run();
}

template bool sweep<kMomentColumns>(const SweepStart&, SweepEnd<kMomentColumns>&) noexcept;
template bool sweep<kWrenchColumns>(const SweepStart&, SweepEnd<kWrenchColumns>&) noexcept;
template bool sweep<kAllColumns>(const SweepStart&, SweepEnd<kAllColumns>&) noexcept;

}  // namespace tandem::kinematics::cosserat
