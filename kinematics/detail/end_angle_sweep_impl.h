// SPDX-License-Identifier: Apache-2.0
/** @file Template implementation of EndAngleSweep. */
#pragma once

#include <limits>

#include "kinematics/end_angle_sweep.h"

namespace tandem::kinematics {

/// Twist (linear at the origin, angular) of a frame at `position`, `rotation`, from the same twist given in that frame.
template <class Scalar, int kColumns>
Eigen::Matrix<Scalar, 6, kColumns> movedTwist(const Eigen::Matrix<Scalar, 3, 3>& rotation,
                                              const Eigen::Matrix<Scalar, 3, 1>& position,
                                              const Eigen::Matrix<Scalar, 6, kColumns>& twist) {
  Eigen::Matrix<Scalar, 6, kColumns> moved;
  moved.template topRows<3>() = rotation * twist.template topRows<3>();
  moved.template bottomRows<3>() = rotation * twist.template bottomRows<3>();
  for (int j = 0; j < twist.cols(); ++j)
    moved.col(j).template head<3>() += position.cross(moved.col(j).template tail<3>());
  return moved;
}

template <class Scalar>
EndAngleSweep<Scalar>::EndAngleSweep(const ConcentricTubeArm& arm,
                                     const Segmentation& parts,
                                     const Vector& beta,
                                     const Vector& end_angle,
                                     double coupling,
                                     StepDepth depth,
                                     std::span<ShapePoint> samples)
    : arm_(arm),
      tubes_(arm.tubeCount()),
      parts_(parts),
      beta_(beta),
      coupling_(coupling),
      depth_(depth),
      samples_(samples),
      unsampled_(samples.size()),
      s_(parts.length()),
      psi_(end_angle),
      track_(parts.length()) {
  moment_.setConstant(Scalar(0.0));
  psi_by_end_.setIdentity();
  psi_by_beta_.setConstant(Scalar(0.0));
  moment_by_end_.setConstant(Scalar(0.0));
  moment_by_beta_.setConstant(Scalar(0.0));
  rotation_.setIdentity();
  position_.setConstant(Scalar(0.0));
  by_end_.setConstant(Scalar(0.0));
  by_beta_.setConstant(Scalar(0.0));

  Interval distal;
  for (int k = parts_.count - 1; k >= 0; --k) {
    const Interval part = properties(k);
    enter(part, k + 1 == parts_.count ? nullptr : &distal, parts_.interval[k].owner);
    cross(part, boundary(k) - (k == 0 ? Scalar(0.0) : boundary(k - 1)));
    distal = part;
  }
  transmission();
}

template <class Scalar>
typename EndAngleSweep<Scalar>::Interval EndAngleSweep<Scalar>::properties(int index) const {
  Interval part;
  for (int i = 0; i < tubes_; ++i) {
    const int section = parts_.interval[index].section[i];
    part.present[i] = section != Segmentation::kAbsent;
    if (!part.present[i])
      continue;
    const TubeSection& properties = arm_.tubes[i].sections[section];
    part.torsion[i] = properties.torsional_stiffness;
    part.b[i] = properties.bending_stiffness * properties.curvature;
    part.helix[i] = properties.helix_torsion;
    part.helical = part.helical || part.helix[i] != 0.0;
    part.total += properties.bending_stiffness;
    if (part.b[i] != 0.0)
      part.curved[part.curved_count++] = i;
  }
  return part;
}

template <class Scalar>
Scalar EndAngleSweep<Scalar>::boundary(int index) const {
  const Segmentation::Interval& interval = parts_.interval[index];
  Scalar end = beta_[interval.owner];
  for (int k = 0; k <= interval.section[interval.owner]; ++k)
    end += arm_.tubes[interval.owner].sections[k].length;
  return end;
}

template <class Scalar>
Eigen::Matrix<Scalar, 3, 1> EndAngleSweep<Scalar>::bend(const Interval& part) const {
  using std::cos, std::sin;
  Eigen::Matrix<Scalar, 3, 1> u(Scalar(0.0), Scalar(0.0), Scalar(0.0));
  for (int c = 0; c < part.curved_count; ++c) {
    const int i = part.curved[c];
    u.x() -= part.b[i] / part.total * sin(psi_[i]);
    u.y() += part.b[i] / part.total * cos(psi_[i]);
  }
  return u;
}

/// d t_i / ds = b_i (u_x cos psi_i + u_y sin psi_i), N.
template <class Scalar>
std::array<Scalar, kMaxTubes> EndAngleSweep<Scalar>::torque(const Interval& part) const {
  using std::sin;
  std::array<Scalar, kMaxTubes> torque;
  for (int i = 0; i < tubes_; ++i) {
    torque[i] = Scalar(0.0);
    for (int c = 0; c < part.curved_count; ++c) {
      const int j = part.curved[c];
      torque[i] += coupling_ * part.b[i] * part.b[j] / part.total * sin(psi_[i] - psi_[j]);
    }
  }
  return torque;
}

/// The boundary moves with its owner: a small part of `part` replaces `distal`.
template <class Scalar>
void EndAngleSweep<Scalar>::enter(const Interval& part, const Interval* distal, int owner) {
  const std::array<Scalar, kMaxTubes> here = torque(part);
  std::array<Scalar, kMaxTubes> there{};
  there.fill(Scalar(0.0));
  if (distal)
    there = torque(*distal);
  for (int i = 0; i < tubes_; ++i) {
    if (!part.present[i])
      continue;
    moment_by_beta_(i, owner) -= here[i] - there[i];
    const bool continues = distal && distal->present[i];
    if (continues && distal->torsion[i] != part.torsion[i])
      psi_by_beta_(i, owner) -= moment_[i] * (1.0 / part.torsion[i] - 1.0 / distal->torsion[i]);
    if (const double helix = part.helix[i] - (continues ? distal->helix[i] : 0.0); helix != 0.0)
      psi_by_beta_(i, owner) -= helix;
  }
  if (depth_ == StepDepth::kAngles)
    return;
  Eigen::Matrix<Scalar, 6, 1> twist;
  twist.setConstant(Scalar(0.0));
  twist.template tail<3>() = -bend(part);
  if (distal)
    twist.template tail<3>() += bend(*distal);
  else
    twist[2] = Scalar(-1.0);
  by_beta_.col(owner) += movedTwist<Scalar, 1>(rotation_, position_, twist);
}

template <class Scalar>
void EndAngleSweep<Scalar>::cross(const Interval& part, Scalar length) {
  if (!(valueOf(length) > 0.0))
    return;
  switch (part.curved_count) {
    case 0:
      return crossStraight(part, length);
    case 1:
      return crossCurved<1>(part, length);
    case 2:
      return crossCurved<2>(part, length);
    case 3:
      return crossCurved<3>(part, length);
    default:
      return crossCurved<4>(part, length);
  }
}

template <class Scalar>
template <int NC>
Eigen::Matrix<Scalar, 2 * NC, kMaxTubes> EndAngleSweep<Scalar>::states(const Interval& part,
                                                                       const Square& psi,
                                                                       const Square& moment) const {
  Eigen::Matrix<Scalar, 2 * NC, kMaxTubes> state;
  for (int c = 0; c < NC; ++c) {
    const int i = part.curved[c];
    state.row(c) = psi.row(i);
    state.row(NC + c) = moment.row(i) * Scalar(-1.0 / part.torsion[i]);  // tau is constant
  }
  return state;
}

template <class Scalar>
void EndAngleSweep<Scalar>::crossStraight(const Interval& part, const Scalar& length) {
  const Square z = psi_by_end_, moment = moment_by_end_;
  sample(part, length, [&](double x, ShapePoint& point) {
    point.pose.linear() = valuesOf(rotation_);
    point.pose.translation() = valuesOf((position_ - rotation_.col(2) * (length * x)).eval());
  });
  twistFreely(part, length);
  position_ -= rotation_.col(2) * length;
  track(
      part, length, z, moment, [](double, Square&, Square&) {}, [](Square&) {});
}

/// In steps as long as the series converge: usually a single one.
template <class Scalar>
template <int NC>
void EndAngleSweep<Scalar>::crossCurved(const Interval& part, Scalar length) {
  for (double fraction = 0.0; fraction < 1.0;) {
    CurvedTubes<NC, Scalar> tubes;
    tubes.stiffness = part.total;
    for (int c = 0; c < NC; ++c) {
      const int i = part.curved[c];
      tubes.psi[c] = psi_[i];
      tubes.rate[c] = moment_[i] * (-1.0 / part.torsion[i]) - part.helix[i];
      tubes.b[c] = part.b[i];
      tubes.g[c] = coupling_ * part.b[i] / (part.total * part.torsion[i]);
    }
    const TaylorStep<NC, Scalar> step(tubes, length, depth_);
    fraction = step.fraction();
    take<NC>(part, step);
    length -= step.length();
  }
}

template <class Scalar>
template <int NC>
void EndAngleSweep<Scalar>::take(const Interval& part, const TaylorStep<NC, Scalar>& step) {
  const Square z = psi_by_end_, moment = moment_by_end_;
  const auto by_end = states<NC>(part, psi_by_end_, moment_by_end_);
  const auto by_beta = states<NC>(part, psi_by_beta_, moment_by_beta_);
  sample(part, step.length(), [&](double x, ShapePoint& point) {
    point.pose.linear() = valuesOf((rotation_ * step.rotationAt(x)).eval());
    point.pose.translation() = valuesOf((position_ + rotation_ * step.positionAt(x)).eval());
    for (int c = 0; c < NC; ++c) {
      const int i = part.curved[c];
      point.psi[i] = valueOf(step.psi(c, x));
      point.moment[i] = (valueOf(step.rate(c, x)) + part.helix[i]) * -part.torsion[i];
      point.curvature += part.b[i] / part.total * Eigen::Vector2d(-std::sin(point.psi[i]), std::cos(point.psi[i]));
    }
  });
  if (depth_ == StepDepth::kPose) {
    by_end_ += movedTwist<Scalar, kMaxTubes>(rotation_, position_, step.twistByState() * by_end);
    by_beta_ += movedTwist<Scalar, kMaxTubes>(rotation_, position_, step.twistByState() * by_beta);
    position_ += rotation_ * step.position();
    rotation_ = (rotation_ * step.rotation()).eval();
  }
  twistFreely(part, step.length());
  const Eigen::Matrix<Scalar, 2 * NC, kMaxTubes> end = step.transition() * by_end, beta = step.transition() * by_beta;
  for (int c = 0; c < NC; ++c) {
    const int i = part.curved[c];
    const Scalar torsion(-part.torsion[i]);
    psi_[i] = step.psi(c, 1.0);
    moment_[i] = (step.rate(c, 1.0) + part.helix[i]) * torsion;
    psi_by_end_.row(i) = end.row(c);
    psi_by_beta_.row(i) = beta.row(c);
    moment_by_end_.row(i) = end.row(NC + c) * torsion;
    moment_by_beta_.row(i) = beta.row(NC + c) * torsion;
  }
  const auto interior = [&](double x, Square& inner, Square& slope) {
    const auto psi = (step.psiByState(x) * by_end).eval();
    const auto rate = (step.rateByState(x) * by_end).eval();
    for (int c = 0; c < NC; ++c) {
      inner.row(part.curved[c]) = psi.row(c);
      slope.row(part.curved[c]) = rate.row(c) * step.length();
    }
  };
  const auto stiffness = [&](Square& force) {
    Eigen::Matrix<Scalar, NC, kMaxTubes> rows = end.template topRows<NC>();
    const Eigen::Matrix<Scalar, NC, NC> by_rate = step.transition().template topRightCorner<NC, NC>();
    rows = (by_rate.inverse() * rows).eval();
    for (int c = 0; c < NC; ++c)
      force.row(part.curved[c]) = rows.row(c) * part.torsion[part.curved[c]];
  };
  track(part, step.length(), z, moment, interior, stiffness);
}

/// Fills the samples of a piece that begins at the present position; `place` gives the pose in the frame of tube 1's
/// end, and the curvature.
template <class Scalar>
template <class Place>
void EndAngleSweep<Scalar>::sample(const Interval& part, const Scalar& length, const Place& place) {
  constexpr double kRounding = 1e-12;  // a sample at s = 0 is in the last piece, m
  const double h = valueOf(length);
  for (; unsampled_ > 0 && samples_[unsampled_ - 1].s >= s_ - h - kRounding; --unsampled_) {
    ShapePoint& point = samples_[unsampled_ - 1];
    const double x = std::clamp((s_ - point.s) / h, 0.0, 1.0);
    point.psi.fill(std::numeric_limits<double>::quiet_NaN());
    point.moment.fill(std::numeric_limits<double>::quiet_NaN());
    point.curvature.setZero();
    point.outermost_tube = 0;
    for (int i = 0; i < tubes_; ++i) {
      if (!part.present[i])
        continue;
      point.outermost_tube = i + 1;
      point.moment[i] = valueOf(moment_[i]);
      point.psi[i] = valueOf(psi_[i]) - point.moment[i] / part.torsion[i] * x * h;
    }
    place(x, point);
  }
}

/// Angles of tubes without torque; those of curved tubes are overwritten by take().
template <class Scalar>
void EndAngleSweep<Scalar>::twistFreely(const Interval& part, const Scalar& length) {
  for (int i = 0; i < tubes_; ++i) {
    if (!part.present[i])
      continue;
    const Scalar compliance = length * (1.0 / part.torsion[i]);
    psi_[i] -= moment_[i] * compliance;
    psi_by_end_.row(i) -= moment_by_end_.row(i) * compliance;
    psi_by_beta_.row(i) -= moment_by_beta_.row(i) * compliance;
  }
}

template <class Scalar>
typename EndAngleSweep<Scalar>::Square EndAngleSweep<Scalar>::psiSlope(const Interval& part,
                                                                       const Scalar& length,
                                                                       const Square& moment) const {
  Square slope;
  slope.setConstant(Scalar(0.0));
  for (int i = 0; i < tubes_; ++i) {
    if (part.present[i])
      slope.row(i) = moment.row(i) * (length * (-1.0 / part.torsion[i]));
  }
  return slope;
}

/// Adds a piece to the determinant's track. `z` and `moment` are those at its distal end; `interior` fills the rows of
/// curved tubes in between, `stiffness` those of B^-1 Z.
template <class Scalar>
template <class Interior, class Stiffness>
void EndAngleSweep<Scalar>::track(const Interval& part,
                                  const Scalar& length,
                                  const Square& z,
                                  const Square& moment,
                                  const Interior& interior,
                                  const Stiffness& stiffness) {
  using Place = typename DeterminantTrack<Scalar>::Place;
  const double begin = s_;
  s_ -= valueOf(length);
  const Place distal{z, psiSlope(part, length, moment)};
  const Place proximal{psi_by_end_, psiSlope(part, length, moment_by_end_)};
  const auto within = [&](double x) {
    Place place{(z + distal.slope * Scalar(x)).eval(), distal.slope};
    interior(x, place.z, place.slope);
    return place;
  };
  if (part.helical)
    track_.addInParts(DeterminantTrack<Scalar>::kHelicalParts, begin, s_, distal, proximal, within);
  else
    track_.add(begin, s_, distal, proximal, within);
  if constexpr (std::is_same_v<Scalar, double>) {  // the index needs no derivatives
    Square force;
    force.setIdentity();  // absent tubes add nothing
    for (int i = 0; i < tubes_; ++i) {
      if (part.present[i])
        force.row(i) = psi_by_end_.row(i) * (part.torsion[i] / length);
    }
    stiffness(force);
    track_.count(z.transpose() * force);
  }
}

template <class Scalar>
typename EndAngleSweep<Scalar>::Twists EndAngleSweep<Scalar>::inBase(const Twists& twists) const {
  return -movedTwist<Scalar, kMaxTubes>(endRotation(), endPosition(), twists);
}

}  // namespace tandem::kinematics

#include "kinematics/detail/transmission_impl.h"
