// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "config/detail/loaders.h"

namespace tandem::config {
namespace {

/// Tolerance for rounding: a decimal number in mm or degrees at a limit may convert to a value outside it.
constexpr double kSlack = 1e-9;

std::string range(const Map& map, const std::string& key, const safety::JointLimit& joint) {
  if (std::isinf(joint.lower))
    return "at most " + map.inUnit(key, joint.upper);
  if (std::isinf(joint.upper))
    return "at least " + map.inUnit(key, joint.lower);
  return map.inUnit(key, joint.lower) + " to " + map.inUnit(key, joint.upper);
}

void checkBox(const Map& map, const std::string& key, const safety::JointLimit& joint, double value, int element) {
  if (value >= joint.lower - kSlack && value <= joint.upper + kSlack)
    return;
  map.fail(key, "found " + map.inUnit(key, value) + ", expected " + range(map, key, joint), element);
}

void checkRow(const Map& map, const safety::LinearRow& row, const Eigen::VectorXd& q) {
  const double excess = safety::rowValue(row, q) - row.b;
  if (excess <= kSlack)
    return;
  map.fail("beta",
           "found " + map.inUnit("beta", q[row.inner_joint]) + " and " + map.inUnit("beta", q[row.outer_joint]) +
               ", expected equation (1) with its margins; violated by " + map.inUnit("beta", excess) + ": " +
               safety::describe(row),
           row.outer_joint);
}

}  // namespace

Eigen::VectorXd readJoints(const Map& map, const safety::ArmLimits& limits) {
  const int n = limits.jointCount() / 2;
  const std::vector<double> beta = map.numbers("beta", n);
  const std::vector<double> alpha = map.numbers("alpha", n);
  Eigen::VectorXd q(2 * n);
  for (int i = 0; i < n; ++i) {
    q[i] = beta[i];
    q[n + i] = alpha[i];
  }
  for (int i = 0; i < n; ++i) {
    checkBox(map, "beta", limits.joints[i], q[i], i);
    checkBox(map, "alpha", limits.joints[n + i], q[n + i], i);
  }
  for (const safety::LinearRow& row : limits.rows)
    checkRow(map, row, q);
  return q;
}

}  // namespace tandem::config
