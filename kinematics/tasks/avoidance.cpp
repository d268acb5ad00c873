// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tasks/avoidance.h"

#include <algorithm>
#include <cmath>

#include "kinematics/tasks/task_kind.h"

namespace tandem::kinematics {
namespace {

/// S: from 0 at 0 to 1 at 1, with no slope at either.
double smoothStep(double x) { return x >= 1.0 ? 1.0 : x * x * (3.0 - 2.0 * x); }

/// Adds one distance. @return max(0, d - g) / d, the factor of -grad g in the gradient
double add(double g, double distance, Avoidance& sum) {
  sum.least = std::min(sum.least, g);
  const double depth = std::max(0.0, distance - g);
  sum.cost += depth * depth / (2.0 * distance);
  return depth / distance;
}

/// @param lever  |grad C|, dimensionless
double activationOf(double cost, double distance, double lever) {
  const double depth = std::sqrt(2.0 * cost / distance);
  return depth > 0.0 ? smoothStep(depth / Avoidance::kFullDepth) * smoothStep(lever / (Avoidance::kLeastLever * depth))
                     : 0.0;
}

Avoidance nothingNear(Eigen::Index joints) {
  Avoidance none;
  none.least = safety::kUnlimited;
  none.gradient.setZero(joints);
  return none;
}

}  // namespace

Avoidance jointLimitAvoidance(const safety::ArmLimits& limits, const JointsRef& q, double distance) noexcept {
  Avoidance sum = nothingNear(q.size());
  for (int j = 0; j < limits.jointCount(); ++j) {
    const safety::JointLimit& joint = limits.joints[static_cast<std::size_t>(j)];
    const double length = limits.isTranslation(j) ? 1.0 : kLengthPerRadian;
    sum.gradient[j] -= length * add(length * (q[j] - joint.lower), distance, sum);
    sum.gradient[j] += length * add(length * (joint.upper - q[j]), distance, sum);
  }
  for (const safety::LinearRow& row : limits.rows)
    sum.gradient += add(row.b - safety::rowValue(row, q), distance, sum) * row.a.transpose();
  double squares = 0.0;
  for (int j = 0; j < limits.jointCount(); ++j)
    squares += std::pow(sum.gradient[j] / (limits.isTranslation(j) ? 1.0 : kLengthPerRadian), 2);
  sum.activation = activationOf(sum.cost, distance, std::sqrt(squares));
  return sum;
}

Avoidance stabilityAvoidance(const ArmModel& model,
                             const JointsRef& q,
                             const Branch& branch,
                             double stability,
                             double distance) {
  Avoidance sum = nothingNear(q.size());
  if (const double share = add(stability, distance, sum); share > 0.0)
    sum.gradient = -share * model.stabilityGradient(q, branch);
  const Eigen::Index translations = q.size() / 2;  // [beta, alpha]
  const double lever =
      std::hypot(kLengthPerRadian * sum.gradient.head(translations).norm(), sum.gradient.tail(translations).norm());
  sum.activation = activationOf(sum.cost, distance, lever);
  return sum;
}

}  // namespace tandem::kinematics
