// SPDX-License-Identifier: Apache-2.0
#include "robots/detail/trajectory_run.h"

#include <stdexcept>
#include <utility>

namespace tandem::robots {

/// Position of the tip, and relative to the other tip. @return false if either is unknown.
bool TrajectoryRun::place(const planning::TrajectorySpec& spec,
                          const Measured& now,
                          Eigen::Vector3d& tip,
                          Eigen::Vector3d& relative) const {
  std::array<Eigen::Vector3d, 2> tips;
  for (const auto& [arm, to] : {std::pair{spec.arm, &tips[0]}, std::pair{spec.other_arm, &tips[1]}}) {
    const auto k = static_cast<std::size_t>(arm);
    if (!now.valid[k] || (now.tips && !now.tips->arm[k].known))
      return false;
    *to = now.tips ? now.tips->arm[k].position : Eigen::Vector3d(tips_.tip(arm).pose.translation());
  }
  tip = tips[0];
  relative = tips[0] - tips[1];
  return tips_.status() == kinematics::ModelStatus::kOk;
}

std::string TrajectoryRun::start(const std::string& text,
                                 const Measured& now,
                                 std::vector<safety::RobotVector> postures) {
  const planning::TrajectorySpec spec = config::parseTrajectory(text, "planning/request", {});  // without file names
  for (const int arm : {spec.arm, spec.other_arm}) {
    if (arm < 0 || arm >= tips_.armCount() || spec.arm == spec.other_arm)
      throw std::invalid_argument("arm and other_arm: expected two different arms of the " +
                                  std::to_string(tips_.armCount()));
  }
  Eigen::Vector3d tip, relative;
  if (!place(spec, now, tip, relative))
    return "no valid actuation/state yet";
  follower_.start(spec, tip, relative, std::move(postures));
  return {};
}

std::string TrajectoryRun::update(const Measured& now, planning::Reference& reference) {
  Eigen::Vector3d tip, relative;
  if (!place(follower_.spec(), now, tip, relative))
    return now.tips ? "the measured joints or tips are not valid" : "the measured joints are not valid";
  follower_.update(tip, relative, reference);
  return {};
}

std::vector<Eigen::Isometry3d> TrajectoryRun::points() const {
  std::vector<Eigen::Isometry3d> points;
  for (const planning::TrajectoryPoint& point : follower_.points())
    points.emplace_back(Eigen::Translation3d(point.tip));
  return points;
}

}  // namespace tandem::robots
