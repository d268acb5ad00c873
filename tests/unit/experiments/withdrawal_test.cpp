// SPDX-License-Identifier: Apache-2.0
/** @file Sideways motion of the arm body during withdrawal. */
#include <gtest/gtest.h>

#include <functional>

#include "config/config.h"
#include "experiments/run_record.h"
#include "safety/recovery.h"

namespace tandem::experiments {
namespace {

constexpr int kPoints = 161;      ///< of a backbone
constexpr double kStep = 0.5e-3;  ///< m

using Points = std::vector<Eigen::Vector3d>;

Points bodyOf(const kinematics::ArmModel& model, const safety::ArmVector& q) {
  std::vector<kinematics::ShapePoint> shape;
  Points points;
  if (model.shape(q, kPoints, shape) != kinematics::ModelStatus::kOk)
    return points;
  for (const kinematics::ShapePoint& point : shape)
    points.push_back(point.pose.translation());
  return points;
}

double distanceTo(const Points& line, const Eigen::Vector3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector3d displacement = line[i + 1] - line[i];
    const double length = displacement.squaredNorm();
    const double t = length > 0.0 ? std::clamp((p - line[i]).dot(displacement) / length, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, (line[i] + t * displacement - p).norm());
  }
  return nearest;
}

/// One step back; false: no further step is possible.
using Order = std::function<bool(const safety::ArmLimits&, safety::ArmVector&)>;

/// Distance of the body from its original shape while an arm withdraws in a given order, m.
double sweep(const kinematics::ArmModel& model,
             const safety::ArmLimits& limits,
             safety::ArmVector q,
             const Order& order) {
  const Points before = bodyOf(model, q);
  double largest = 0.0;
  for (int i = 0; order(limits, q); ++i) {
    if (i % 8 != 0)
      continue;
    for (const Eigen::Vector3d& p : bodyOf(model, q))
      largest = std::max(largest, distanceTo(before, p));
  }
  return largest;
}

bool innermostFirst(const safety::ArmLimits& limits, safety::ArmVector& q) {
  const safety::Withdrawal next = safety::nextWithdrawal(limits, q, 0, kStep);
  for (int j = 0; j < 3; ++j)
    q[j] -= (next.joints & safety::jointBit(j)) != 0 ? next.distance : 0.0;
  return next.joints != 0;
}

/// Moves the first of these groups of tubes that can move back.
bool inGroups(const safety::ArmLimits& limits, safety::ArmVector& q, const std::vector<std::vector<int>>& groups) {
  for (const std::vector<int>& group : groups) {
    safety::ArmVector next = q;
    for (const int j : group)
      next[j] -= kStep;
    if (safety::largestViolation(limits, next) <= 0.0) {
      q = next;
      return true;
    }
  }
  return false;
}
bool togetherFirst(const safety::ArmLimits& limits, safety::ArmVector& q) {
  return inGroups(limits, q, {{0, 1, 2}, {0, 1}, {0}, {1, 2}, {1}, {2}});
}
bool outermostFirst(const safety::ArmLimits& limits, safety::ArmVector& q) {
  return inGroups(limits, q, {{2}, {1}, {0}, {1, 2}, {0, 1}, {0, 1, 2}});
}

TEST(Withdrawal, InnermostFirstMovesTheBodySidewaysLeast) {
  const std::string presets = TANDEM_PRESETS;
  const config::Robot robot = config::loadRobot(presets + "/robots/ark2024.yaml");
  const config::Experiment table = config::loadExperiment(presets + "/experiments/table3.yaml");
  for (const char* name : {"rigid", "compliant"}) {
    const RobotModel model(robot, name);
    for (const config::Configuration& configuration : table.configurations) {
      for (std::size_t a = 0; a < 2; ++a) {
        const safety::ArmVector q = configuration.joints[a];
        const auto measured = [&](const Order& order) {
          return sweep(*model.models()[a], *model.limits()[a], q, order);
        };
        const double first = measured(innermostFirst), together = measured(togetherFirst),
                     outer = measured(outermostFirst);
        std::printf(
            "%s, configuration %s, arm %c: innermost first %.1f mm, together %.1f mm, outermost first %.1f mm\n", name,
            configuration.name.c_str(), a == 0 ? 'A' : 'B', 1e3 * first, 1e3 * together, 1e3 * outer);
        EXPECT_LE(first, std::min(together, outer) + 1e-4);
      }
    }
  }
}

}  // namespace
}  // namespace tandem::experiments
