// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>

#include "config/detail/loaders.h"

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

void checkWall(const Map& map, double outer, double inner) {
  if (inner >= outer)
    map.fail("inner_diameter", "found " + map.inUnit("inner_diameter", inner) +
                                   ", expected less than the outer diameter of " + map.inUnit("inner_diameter", outer));
}

void readArms(const Map& map, const std::function<void(const Map&)>& read) {
  map.eachDistinct("arms", "name", [&](const Map& arm) {
    if (arm.text("name") == "pair")
      arm.fail("name", "found 'pair', which stands for two arms together in names of topics, expected another name");
    read(arm);
  });
}

}  // namespace tandem::config
