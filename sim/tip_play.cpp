// SPDX-License-Identifier: Apache-2.0
#include "sim/tip_play.h"

#include <algorithm>

namespace tandem::sim {

TipPlay::TipPlay(const kinematics::ConcentricTubeArm& arm, double clearance, double ovality)
    : tubes_(arm.tubeCount()), clearance_(clearance + 0.5 * ovality) {
  for (int i = 0; i < tubes_; ++i) {
    length_[i] = arm.tubes[static_cast<std::size_t>(i)].length();
    guide_[i] = arm.tubes[static_cast<std::size_t>(i)].sections.back().length;
  }
}

double TipPlay::radius(const safety::ArmVector& q) const noexcept {
  const double tip = q[0] + length_[0];
  double sum = 0.0;
  for (int i = 1; i < tubes_; ++i)
    sum += clearance_ * (0.5 + std::max(0.0, tip - std::max(0.0, q[i] + length_[i])) / guide_[i]);
  return sum;
}

void TipPlay::apply(const safety::ArmVector& q, Eigen::Isometry3d& pose) noexcept {
  const Eigen::Vector3d ideal = pose.translation(), axis = pose.linear().col(2);
  Eigen::Vector3d offset = known_ ? Eigen::Vector3d(tip_ - ideal) : Eigen::Vector3d::Zero();
  offset -= axis * axis.dot(offset);
  const double largest = radius(q), size = offset.norm();
  if (size > largest)
    offset *= largest / size;
  tip_ = ideal + offset;
  known_ = true;
  pose.translation() = tip_;
}

}  // namespace tandem::sim
