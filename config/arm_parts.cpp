// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>

#include "config/loaders.h"

namespace tandem::config {

Eigen::Isometry3d readPose(const Map& map) {
  const Eigen::Vector3d rpy = map.vector3("rpy");
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  pose.translation() = map.vector3("position");
  return pose;
}

void readMotion(const Map& map, safety::JointLimit& limit) {
  limit.velocity = map.number("velocity");
  limit.approach_acceleration = map.number("approach_acceleration");
  limit.slew_limit = map.number("slew_limit");
  limit.stop_deceleration = map.number("stop_deceleration");
  limit.max_step = map.number("max_step");
}

control::MethodParameters readParameters(const Map& map) {
  control::MethodParameters parameters;
  parameters.period = map.number("period");
  parameters.bounds = control::boundsFromName(map.text("bounds")).value();
  parameters.backend = control::backendFromName(map.text("backend")).value();
  for (const control::Tunable& tunable : control::kTunables)
    parameters.*tunable.member = map.number(tunable.name);
  parameters.least_stability = map.number("least_stability");
  parameters.least_distance = map.number("least_distance");
  return parameters;
}

void refusePair(const Map& arm) {
  if (arm.text("name") == "pair")
    arm.fail("name", "found 'pair', which stands for two arms together in names of topics, expected another name");
}

}  // namespace tandem::config
