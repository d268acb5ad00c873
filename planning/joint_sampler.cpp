// SPDX-License-Identifier: Apache-2.0
#include "planning/joint_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::planning {

JointSampler::JointSampler(const safety::ArmLimits& limits) : limits_(limits) {
  const int n = limits.jointCount() / 2;
  for (int i = 0; i < n; ++i) {
    reach_.push_back({limits.joints[i].lower, limits.joints[i].upper});
    offset_.push_back({-safety::kUnlimited, safety::kUnlimited});
  }
  for (const safety::LinearRow& row : limits.rows) {
    safety::Interval& offset = offset_[static_cast<std::size_t>(row.outer_joint)];
    if (row.kind == safety::RowKind::kCarriageSpacing)
      offset.lower = std::max(offset.lower, -row.b);
    else
      offset.upper = std::min(offset.upper, row.b);
  }
  for (int i = n - 2; i >= 0; --i) {
    reach_[i].lower = std::max(reach_[i].lower, reach_[i + 1].lower - offset_[i + 1].upper);
    reach_[i].upper = std::min(reach_[i].upper, reach_[i + 1].upper - offset_[i + 1].lower);
  }
}

safety::Interval JointSampler::room(int tube, double before) const {
  safety::Interval room = reach_[tube];
  if (tube > 0) {
    room.lower = std::max(room.lower, before + offset_[tube].lower);
    room.upper = std::min(room.upper, before + offset_[tube].upper);
  }
  return {std::min(room.lower, room.upper), room.upper};
}

safety::ArmVector JointSampler::random(std::mt19937_64& engine) const {
  const int n = limits_.jointCount() / 2;
  safety::ArmVector q(2 * n);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < n; ++i) {
    const auto [lower, upper] = room(i, i == 0 ? 0.0 : q[i - 1]);
    q[i] = lower + unit(engine) * (upper - lower);
  }
  for (int j = n; j < 2 * n; ++j) {
    const double lower = std::max(limits_.joints[j].lower, -std::numbers::pi);
    const double upper = std::min(limits_.joints[j].upper, std::max(std::numbers::pi, lower));
    q[j] = std::min(lower, upper) + unit(engine) * std::max(0.0, upper - lower);
  }
  return q;
}

safety::ArmVector JointSampler::middle(const safety::ArmVector& q) const {
  const int n = limits_.jointCount() / 2;
  safety::ArmVector result = inside(q);
  for (int i = 0; i < n; ++i) {
    const auto [lower, upper] = room(i, i == 0 ? 0.0 : result[i - 1]);
    result[i] = 0.5 * (lower + upper);
  }
  return result;
}

safety::ArmVector JointSampler::inside(const safety::ArmVector& q) const {
  const int n = limits_.jointCount() / 2;
  safety::ArmVector result = q;
  for (int i = 0; i < n; ++i) {
    const auto [lower, upper] = room(i, i == 0 ? 0.0 : result[i - 1]);
    result[i] = std::clamp(q[i], lower, upper);
    result[n + i] = std::clamp(q[n + i], limits_.joints[n + i].lower, limits_.joints[n + i].upper);
  }
  return result;
}

bool JointSampler::turnsFreely() const {
  return std::all_of(
      limits_.joints.begin() + limits_.jointCount() / 2, limits_.joints.end(),
      [](const safety::JointLimit& joint) { return std::isinf(joint.lower) && std::isinf(joint.upper); });
}

}  // namespace tandem::planning
