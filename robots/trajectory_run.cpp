// SPDX-License-Identifier: Apache-2.0
#include "robots/detail/trajectory_run.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "config/arm_names.h"
#include "planning/insertion.h"

namespace tandem::robots {

/// Whether the poses of the tips of all arms of the trajectory are known.
bool TrajectoryRun::known(const planning::TrajectorySpec& spec, const Measured& now) const {
  const bool positions =
      tips_.status() == kinematics::ModelStatus::kOk && std::ranges::all_of(spec.arms(), [&](int arm) {
        const auto k = static_cast<std::size_t>(arm);
        return now.valid[k] && (!now.tips || now.tips->arm[k].known);
      });
  const auto oriented = [&](int arm) { return now.tips->arm[static_cast<std::size_t>(arm)].oriented.known; };
  return positions && (!now.tips || !now.tips->useOrientations() ||
                       std::ranges::all_of(spec.further, [&](const planning::FurtherTask& task) {
                         return !kinematics::findTaskKind(task.kind)->needsOrientation() ||
                                (oriented(task.arm) && (!task.relative() || oriented(task.other_arm)));
                       }));
}

std::string TrajectoryRun::start(const std::string& text,
                                 const Measured& now,
                                 std::vector<safety::RobotVector> postures) {
  planning::TrajectorySpec spec = config::parseTrajectory(text, "planning/request", {});  // without file names
  if (const std::string wrong = config::findArms(spec, robot_); !wrong.empty())
    throw std::invalid_argument("trajectory: " + wrong);
  if (const std::string wrong = spec.wrongModels(models_); !wrong.empty())
    throw std::invalid_argument("trajectory: " + wrong);
  if (!known(spec, now))
    return "no valid actuation/state received yet; check that tandem-sim or tandem-hal is running";
  planning::setInsertion({models_, limits_}, now.joints, spec);
  follower_.start(spec, planning::pointAt(spec, tips_, now.tips), std::move(postures));
  return {};
}

std::string TrajectoryRun::update(const Measured& now, planning::Reference& reference) {
  if (!known(follower_.spec(), now))
    return now.tips ? "the measured joints or tips are not valid" : "the measured joints are not valid";
  follower_.update(tips_, now.tips, reference);
  return {};
}

std::vector<Eigen::Isometry3d> TrajectoryRun::points() const {
  std::vector<Eigen::Isometry3d> points;
  for (const planning::TrajectoryPoint& point : follower_.points())
    points.emplace_back(Eigen::Translation3d(point.tip));
  return points;
}

}  // namespace tandem::robots
