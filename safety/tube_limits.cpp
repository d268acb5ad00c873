// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "safety/limits.h"

namespace tandem::safety {
namespace {

[[noreturn]] void refuse(const std::string& message) { throw std::invalid_argument("tube limits: " + message); }

std::string tube(std::size_t index) { return "tube " + std::to_string(index + 1); }

void requireSize(const std::vector<double>& values, std::size_t size, const std::string& what) {
  if (values.size() != size) {
    refuse(what + " needs " + std::to_string(size) + " values, found " + std::to_string(values.size()));
  }
}

void requirePositive(const JointLimit& joint, const std::string& what) {
  // Written so that NaN is refused too.
  for (const double value :
       {joint.velocity, joint.approach_acceleration, joint.slew_limit, joint.stop_deceleration, joint.max_step}) {
    if (!(value > 0.0))
      refuse(what + ": velocity, accelerations and max_step must be above zero");
  }
}

void checkSpec(const TubeLimitSpec& spec) {
  const std::size_t n = spec.tube_length.size();
  if (n < 1 || 2 * n > static_cast<std::size_t>(kMaxJointsPerArm)) {
    refuse("1 to " + std::to_string(kMaxJointsPerArm / 2) + " tubes expected, found " + std::to_string(n));
  }
  requireSize(spec.carriage_spacing, n - 1, "carriage_spacing");
  requireSize(spec.minimum_extension, n - 1, "minimum_extension");
  requireSize(spec.stage_minimum, n, "stage_minimum");
  requireSize(spec.stage_maximum, n, "stage_maximum");
  for (std::size_t i = 0; i < n; ++i) {
    const double length = spec.tube_length[i];
    if (!(length > 0.0) || !std::isfinite(length))
      refuse(tube(i) + ": length must be finite and above zero");
    if (std::isnan(spec.stage_minimum[i]) || std::isnan(spec.stage_maximum[i]))
      refuse(tube(i) + ": stage is NaN");
  }
  for (std::size_t i = 0; i + 1 < n; ++i) {
    for (const double margin : {spec.carriage_spacing[i], spec.minimum_extension[i]}) {
      if (!(margin >= 0.0) || !std::isfinite(margin)) {
        refuse("the margins between " + tube(i) + " and " + tube(i + 1) + " must be finite and not negative");
      }
    }
  }
  requirePositive(spec.translation, "translation");
  requirePositive(spec.rotation, "rotation");
  if (!(spec.rotation.lower < spec.rotation.upper))
    refuse("rotation: lower must be below upper");
}

/// Position of tube i less position of tube i-1 must lie in [spacing, l_{i-1} - l_i - extension].
double largestOffset(const TubeLimitSpec& spec, std::size_t i) {
  return spec.tube_length[i - 1] - spec.tube_length[i] - spec.minimum_extension[i - 1];
}

/// Interval that each tube can reach with all inner tubes inside their limits, from the inside out.
void requireRoom(const TubeLimitSpec& spec, const ArmLimits& limits) {
  Interval reach{limits.joints[0].lower, limits.joints[0].upper};
  for (std::size_t i = 0; i < spec.tube_length.size(); ++i) {
    const JointLimit& box = limits.joints[i];
    if (i > 0) {
      if (!(largestOffset(spec, i) >= spec.carriage_spacing[i - 1])) {
        refuse(tube(i) + " is too long to stay inside " + tube(i - 1) + " with these margins");
      }
      reach = {std::max(box.lower, reach.lower + spec.carriage_spacing[i - 1]),
               std::min(box.upper, reach.upper + largestOffset(spec, i))};
    }
    if (!(box.lower < box.upper) || !(reach.lower <= reach.upper)) {
      refuse(tube(i) + ": stage, lengths and margins leave no room");
    }
  }
}

LinearRow makeRow(int joint_count, int inner, double inner_coefficient, double b, RowKind kind, double acceleration) {
  LinearRow row;
  row.a = ArmVector::Zero(joint_count);
  row.a[inner] = inner_coefficient;
  row.a[inner + 1] = -inner_coefficient;
  row.b = b;
  row.kind = kind;
  row.inner_joint = inner;
  row.outer_joint = inner + 1;
  row.approach_acceleration = acceleration;
  return row;
}

}  // namespace

ArmLimits makeTubeLimits(const TubeLimitSpec& spec) {
  checkSpec(spec);
  const int n = static_cast<int>(spec.tube_length.size());
  ArmLimits limits;
  limits.joints.assign(n, spec.translation);
  limits.joints.insert(limits.joints.end(), n, spec.rotation);
  for (int i = 0; i < n; ++i) {
    limits.joints[i].kind = JointKind::kTranslation;
    limits.joints[n + i].kind = JointKind::kRotation;
    // The parts of (1) that concern one tube: -l_i <= beta_i <= 0, narrowed by the travel of the stage.
    limits.joints[i].lower = std::max(-spec.tube_length[i], spec.stage_minimum[i]);
    limits.joints[i].upper = std::min(0.0, spec.stage_maximum[i]);
  }
  for (int i = 1; i < n; ++i) {
    // The parts of (1) that couple tube i to the tube inside it, with margins.
    limits.rows.push_back(makeRow(2 * n, i - 1, 1.0, -spec.carriage_spacing[i - 1], RowKind::kCarriageSpacing,
                                  spec.translation.approach_acceleration));
    limits.rows.push_back(makeRow(2 * n, i - 1, -1.0, largestOffset(spec, i), RowKind::kMinimumExtension,
                                  spec.translation.approach_acceleration));
  }
  requireRoom(spec, limits);
  return limits;
}

}  // namespace tandem::safety
