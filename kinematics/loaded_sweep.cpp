// SPDX-License-Identifier: Apache-2.0
#include "kinematics/loaded_sweep.h"

#include <algorithm>
#include <boost/numeric/odeint/algebra/vector_space_algebra.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cmath>
#include <limits>

#include "kinematics/detail/loaded_state.h"
#include "kinematics/detail/transmission.h"
#include "kinematics/rotations.h"

namespace tandem::kinematics {

using namespace loaded_state;

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTolerance = 1e-11;   ///< error of a step: rad, m, and of the derivatives relative to their size
constexpr int kMaxSweepSteps = 1000;   ///< in one interval
constexpr double kLongestStep = 0.02;  ///< no conjugate point lies within a step by itself, m

using Stepper = boost::numeric::odeint::runge_kutta_fehlberg78<LoadedSweep::State,
                                                               double,
                                                               LoadedSweep::State,
                                                               double,
                                                               boost::numeric::odeint::vector_space_algebra>;

}  // namespace

LoadedSweep::LoadedSweep(const ConcentricTubeArm& arm,
                         const Segmentation& parts,
                         const TubeVector& beta,
                         const LoadedGuess& guess,
                         const Wrench& wrench,
                         bool refine,
                         std::vector<ShapePoint>* samples)
    : arm_(arm),
      parts_(parts),
      beta_(beta),
      guess_(guess),
      has_potential_(wrench.tail<3>().isZero(0.0)),
      refine_(refine),
      samples_(samples),
      unsampled_(samples ? samples->size() : 0),
      s_(parts.length()),
      track_(parts.length()) {
  const Matrix3d& end = guess_.end;
  tool_ = Eigen::AngleAxisd(guess_.theta[0], Vector3d::UnitZ()) * Vector3d(arm.tool.translation());
  force_ = end.transpose() * wrench.head<3>();
  moment_ = end.transpose() * wrench.tail<3>() + tool_.cross(force_);
  // A rotation w of the end frame (base frame) changes end' F by end' (F x w).
  load_by_wrench_.setZero();
  load_by_wrench_.topLeftCorner<3, 3>() = end.transpose();
  load_by_wrench_.bottomRightCorner<3, 3>() = end.transpose();
  load_by_wrench_.bottomLeftCorner<3, 3>() = skew(tool_) * end.transpose();
  load_by_unknowns_.setZero();
  load_by_unknowns_.topRightCorner<3, 3>() = end.transpose() * skew(wrench.head<3>());
  load_by_unknowns_.bottomRightCorner<3, 3>() =
      end.transpose() * skew(wrench.tail<3>()) + skew(tool_) * load_by_unknowns_.topRightCorner<3, 3>();
  load_by_unknowns_.col(0).tail<3>() = Vector3d::UnitZ().cross(tool_).cross(force_);
  load_by_variation_ << load_by_unknowns_.leftCols<kMaxTubes>(), load_by_unknowns_.rightCols<3>() * end.leftCols<2>();

  y_.setZero();
  y_.head<kMaxTubes>() = guess.theta;
  y_[kMaxTubes] = moment_.z();
  Eigen::Map<Matrix3d>(y_.data() + 2 * kMaxTubes).setIdentity();
  columns(y_).topLeftCorner<kMaxTubes, kMaxTubes>().setIdentity();
  columns(y_)(kMaxTubes, kMoment + 2) = 1.0;
  moment_by_column_.setZero();
  moment_by_column_.middleCols<3>(kMoment).setIdentity();

  Interval distal;
  for (int k = parts_.count - 1; k >= 0; --k) {
    const Interval part = properties(k);
    enter(part, k + 1 == parts_.count ? nullptr : &distal, parts_.interval[k].owner);
    cross(part, parts_.interval[k].start, parts_.interval[k].end);
    distal = part;
  }
  transmission();
  finish();
}

LoadedSweep::Interval LoadedSweep::properties(int index) const {
  Interval part;
  for (int i = 0; i < arm_.tubeCount(); ++i) {
    const int section = parts_.interval[index].section[i];
    part.present[i] = section != Segmentation::kAbsent;
    if (!part.present[i])
      continue;
    const TubeSection& properties = arm_.tubes[i].sections[section];
    part.b[i] = properties.bending_stiffness * properties.curvature;
    part.compliance[i] = 1.0 / properties.torsional_stiffness;
    part.total += properties.bending_stiffness;
  }
  return part;
}

Vector2d LoadedSweep::bend(const Interval& part, const State& y) const {
  const Vector3d moment = rotation(y).transpose() * (moment_ - position(y).cross(force_));
  Vector2d sum = moment.head<2>();
  for (int i = 0; i < kMaxTubes; ++i)
    sum += part.b[i] * Vector2d(-std::sin(y[i]), std::cos(y[i]));
  return sum / part.total;
}

/// d t_i / ds, N.
TubeVector LoadedSweep::torque(const Interval& part, const State& y) const {
  const Vector2d u = bend(part, y);
  TubeVector torque;
  for (int i = 0; i < kMaxTubes; ++i)
    torque[i] = part.b[i] * (u.x() * std::cos(y[i]) + u.y() * std::sin(y[i]));
  return torque;
}

void LoadedSweep::derivative(const Interval& part, const State& y, State& slope) const {
  const Matrix3d r = rotation(y);
  const Vector3d p = position(y), moment = moment_ - p.cross(force_);
  TubeVector c, s;
  Vector2d u = (r.transpose() * moment).head<2>();
  for (int i = 0; i < kMaxTubes; ++i) {
    c[i] = std::cos(y[i]);
    s[i] = std::sin(y[i]);
    u += part.b[i] * Vector2d(-s[i], c[i]);
  }
  u /= part.total;
  slope.head<kMaxTubes>() = -part.compliance.cwiseProduct(moments(y));
  slope.segment<kMaxTubes>(kMaxTubes) = -part.b.cwiseProduct(u.x() * c + u.y() * s);
  Eigen::Map<Matrix3d>(slope.data() + 2 * kMaxTubes) = -r * skew(Vector3d(u.x(), u.y(), 0.0));
  slope.segment<3>(2 * kMaxTubes + 9) = -r.col(2);

  const auto column = columns(y);
  auto change = columns(slope);
  const TubeVector bc = part.b.cwiseProduct(c), bs = part.b.cwiseProduct(s);
  const TubeVector own = part.b.cwiseProduct(u.y() * c - u.x() * s);
  for (int j = 0; j < kColumns; ++j) {
    const auto d = column.col(j);
    const Vector3d turn = d.segment<3>(kTurn), shift = d.segment<3>(kShift);
    Vector3d dm = moment.cross(turn) - shift.cross(force_) + moment_by_column_.col(j);
    if (j >= kForce && j < kMoment)
      dm -= p.cross(Vector3d::Unit(j - kForce));
    Vector2d du(r.col(0).dot(dm), r.col(1).dot(dm));
    const auto dpsi = d.head<kMaxTubes>();
    du.x() -= bc.dot(dpsi);
    du.y() -= bs.dot(dpsi);
    du /= part.total;
    change.col(j).head<kMaxTubes>() = -part.compliance.cwiseProduct(d.segment<kMaxTubes>(kMaxTubes));
    change.col(j).segment<kMaxTubes>(kMaxTubes) = -(du.x() * bc + du.y() * bs + own.cwiseProduct(dpsi));
    change.col(j).segment<3>(kTurn) = -(r.col(0) * du.x() + r.col(1) * du.y());
    change.col(j).segment<3>(kShift) = r.col(2).cross(turn);
  }
}

/// The boundary moves with its owner: a small part of `part` replaces `distal`.
void LoadedSweep::enter(const Interval& part, const Interval* distal, int owner) {
  const TubeVector none = TubeVector::Zero();
  auto column = columns(y_).col(kTranslation + owner);
  column.segment<kMaxTubes>(kMaxTubes) -= torque(part, y_) - (distal ? torque(*distal, y_) : none);
  column.head<kMaxTubes>() -= (part.compliance - (distal ? distal->compliance : none)).cwiseProduct(moments(y_));
  const Matrix3d r = rotation(y_);
  const Vector2d du = bend(part, y_) - (distal ? bend(*distal, y_) : Vector2d(0.0, 0.0));
  column.segment<3>(kTurn) -= r.leftCols<2>() * du;
  if (!distal)
    column.segment<3>(kShift) -= r.col(2);
}

void LoadedSweep::cross(const Interval& part, double start, double end) {
  const auto system = [&](const State& y, State& slope, double) { derivative(part, y, slope); };
  Stepper stepper;
  State next, error;
  startStep(part);
  double step = std::min(kLongestStep, end - start);
  for (int steps = 0; s_ > start; ++steps) {
    if (steps > kMaxSweepSteps) {  // excessive load: NaN, because there is no solution
      y_.setConstant(std::numeric_limits<double>::quiet_NaN());
      s_ = start;
      return;
    }
    while (unsampled_ > 0 && (*samples_)[unsampled_ - 1].s >= s_)
      sample(part, (*samples_)[--unsampled_]);
    const double stop = unsampled_ > 0 ? std::max(start, (*samples_)[unsampled_ - 1].s) : start;
    const bool reaches = step >= s_ - stop;
    const double h = reaches ? s_ - stop : step;
    stepper.do_step(system, y_, -s_, next, h, error);
    const double base = error.head<kBase>().cwiseAbs().maxCoeff();
    const double derivatives = error.tail<kRows * kColumns>().cwiseAbs().maxCoeff() /
                               (1.0 + next.tail<kRows * kColumns>().cwiseAbs().maxCoeff());
    const double excess = std::max(base, derivatives) / kTolerance;
    constexpr double kShortest = 1e-7;
    if (excess > 1.0 && h > kShortest) {
      step = h * std::max(0.2, 0.9 * std::pow(excess, -1.0 / 8.0));
      continue;
    }
    y_.swap(next);  // `next` is now the state at the start of the step
    track(part, next, h);
    s_ = reaches ? stop : s_ - h;
    startStep(part);
    if (!reaches || excess < 1e-3)
      step = std::min(kLongestStep, h * std::min(4.0, 0.9 * std::pow(std::max(excess, 1e-9), -1.0 / 8.0)));
    step = std::max(step, kShortest);
  }
  while (unsampled_ > 0 && (*samples_)[unsampled_ - 1].s >= s_)
    sample(part, (*samples_)[--unsampled_]);
}

/// Columns by the moments at the start of a step, which hold the part of the arm in front of it there.
void LoadedSweep::startStep(const Interval& part) {
  const double size = -part.total / kLongestStep;  // backwards along s; the size has no influence
  const Matrix3d r = rotation(y_);
  auto column = columns(y_);
  column.rightCols<kVariation>().setZero();
  moment_by_column_.rightCols<kVariation>().setZero();
  for (int i = 0; i < kMaxTubes; ++i) {
    if (!part.present[i])
      continue;
    column(kMaxTubes + i, kStep + i) = size;
    moment_by_column_.col(kStep + i) = size * r.col(2);
  }
  moment_by_column_.rightCols<2>() = size * r.leftCols<2>();
}

/// One step of integration without error estimate.
LoadedSweep::State LoadedSweep::advanced(const Interval& part, const State& from, double length) const {
  const auto system = [&](const State& y, State& slope, double) { derivative(part, y, slope); };
  Stepper stepper;
  State to, error;
  stepper.do_step(system, from, 0.0, to, length, error);
  return to;
}

void LoadedSweep::sample(const Interval& part, ShapePoint& point) const {
  point.pose.linear() = rotation(y_);
  point.pose.translation() = position(y_);
  point.curvature = bend(part, y_);
  point.psi.fill(std::numeric_limits<double>::quiet_NaN());
  point.moment.fill(std::numeric_limits<double>::quiet_NaN());
  point.outermost_tube = 0;
  for (int i = 0; i < kMaxTubes; ++i) {
    if (!part.present[i])
      continue;
    point.psi[i] = y_[i];
    point.moment[i] = y_[kMaxTubes + i];
    point.outermost_tube = i + 1;
  }
}

void LoadedSweep::transmission() {
  const Interval entry = properties(0);
  const TubeVector compliance = trackTransmission(entry);
  base_angle_ = psi(y_) - compliance.cwiseProduct(moments(y_));
  // Derivatives of (psi - F t, turn in the base frame) by all columns.
  const auto column = columns(y_);
  Eigen::Matrix<double, kLoadedUnknowns, kStep> base;
  base.topRows<kMaxTubes>() =
      column.topLeftCorner<kMaxTubes, kStep>() - compliance.asDiagonal() * column.block<kMaxTubes, kStep>(kMaxTubes, 0);
  base.bottomRows<3>() = guess_.end * column.block<3, kStep>(kTurn, 0);
  by_translation_ = base.rightCols<kMaxTubes>();
  for (int i = 0; i < arm_.tubeCount(); ++i)
    by_translation_(i, i) += moments(y_)[i] * entry.compliance[i];
  const auto by_load = base.middleCols<6>(kForce);
  by_wrench_ = by_load * load_by_wrench_;
  by_unknowns_ = by_load * load_by_unknowns_;
  by_unknowns_.leftCols<kMaxTubes>() += base.leftCols<kMaxTubes>();
  by_unknowns_.bottomRightCorner<3, 3>() += Matrix3d::Identity();
}

/// The base point is fixed, so the end is at -end p; transfers the derivatives to the tool's tip.
void LoadedSweep::finish() {
  base_turn_ = logarithm(guess_.end * rotation(y_));
  end_position_ = -(guess_.end * position(y_));
  const Vector3d tool = guess_.end * tool_, axis = guess_.end.col(2);
  tip_ = end_position_ + tool;
  const auto shift = columns(y_).middleRows<3>(kShift);
  const Eigen::Matrix<double, 3, 6> by_load = -guess_.end * shift.middleCols<6>(kForce);
  tip_by_unknowns_.setZero();
  tip_by_unknowns_.topRows<3>() = by_load * load_by_unknowns_;
  tip_by_unknowns_.topLeftCorner<3, kMaxTubes>() -= guess_.end * shift.leftCols<kMaxTubes>();
  tip_by_unknowns_.topRightCorner<3, 3>() -= skew(tip_);
  tip_by_unknowns_.bottomRightCorner<3, 3>().setIdentity();
  tip_by_unknowns_.col(0).head<3>() += axis.cross(tool);
  tip_by_unknowns_.col(0).tail<3>() += axis;
  tip_by_wrench_.setZero();
  tip_by_wrench_.topRows<3>() = by_load * load_by_wrench_;
  tip_by_translation_.setZero();
  tip_by_translation_.topRows<3>() = -guess_.end * shift.middleCols<kMaxTubes>(kTranslation);
}

}  // namespace tandem::kinematics
