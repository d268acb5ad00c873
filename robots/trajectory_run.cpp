// SPDX-License-Identifier: Apache-2.0
#include "robots/detail/trajectory_run.h"

#include <stdexcept>
#include <utility>

#include "config/arm_names.h"

namespace tandem::robots {

/// Where the tips are; nothing if that of one of its arms is unknown.
std::optional<planning::TrajectoryPoint> TrajectoryRun::place(const planning::TrajectorySpec& spec,
                                                              const Measured& now) const {
  if (tips_.status() != kinematics::ModelStatus::kOk)
    return {};
  for (const int arm : spec.arms()) {
    const auto k = static_cast<std::size_t>(arm);
    if (!now.valid[k] || (now.tips && !now.tips->arm[k].known))
      return {};
  }
  return planning::pointAt(spec, tips_, now.tips);
}

std::string TrajectoryRun::start(const std::string& text,
                                 const Measured& now,
                                 std::vector<safety::RobotVector> postures) {
  planning::TrajectorySpec spec = config::parseTrajectory(text, "planning/request", {});  // without file names
  if (const std::string wrong = config::findArms(spec, robot_); !wrong.empty())
    throw std::invalid_argument("trajectory: " + wrong);
  const auto at = place(spec, now);
  if (!at)
    return "no valid actuation/state yet";
  follower_.start(spec, *at, std::move(postures));
  return {};
}

std::string TrajectoryRun::update(const Measured& now, planning::Reference& reference) {
  const auto at = place(follower_.spec(), now);
  if (!at)
    return now.tips ? "the measured joints or tips are not valid" : "the measured joints are not valid";
  follower_.update(*at, reference);
  return {};
}

std::vector<Eigen::Isometry3d> TrajectoryRun::points() const {
  std::vector<Eigen::Isometry3d> points;
  for (const planning::TrajectoryPoint& point : follower_.points())
    points.emplace_back(Eigen::Translation3d(point.tip));
  return points;
}

}  // namespace tandem::robots
