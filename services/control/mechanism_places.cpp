// SPDX-License-Identifier: Apache-2.0
#include "services/control/mechanism_places.h"

#include <algorithm>

#include "operation/convert.h"
#include "robots/robot_type.h"

namespace tandem::control_service {

MechanismPlaces::MechanismPlaces(const runtime::Setup& setup, const robots::RobotModel& robot)
    : setup_(setup), robot_(robot), follower_(robots::makeEquilibriumFollower(setup.robot)) {
  for (int k = 0; k < robot.armCount(); ++k)
    radius_.push_back(static_cast<float>(robots::typeOf(setup.robot).appearance(setup.robot, k).tubes[0].outer_radius));
}

bool MechanismPlaces::update(const dds::ActuationState& state) {
  safety::RobotVector q;
  if (!dds::measuredJoints(state, robot_.armCount(), robot_.jointCount(), q))
    return false;
  if (session_ != 0 && (session_ != state.session || joint_resets_ != state.joint_resets))
    follower_ = robots::makeEquilibriumFollower(setup_.robot);
  session_ = state.session;
  joint_resets_ = state.joint_resets;
  if (!tips_.empty() && q == follower_.joints())
    return true;
  if (!follower_.solveEquilibrium(q).empty())
    return false;
  tips_ = follower_.mechanism().tips();
  wrenches_ = follower_.mechanism().tipWrenches();
  shapes_ = follower_.mechanism().shapes();
  return true;
}

dds::Shape MechanismPlaces::shape(int arm) const {
  const auto k = static_cast<std::size_t>(arm);
  dds::Shape shape;
  for (const Eigen::Vector3d& place : shapes_[k]) {
    for (const double x : place)
      shape.points.push_back(static_cast<float>(x));
  }
  shape.tubes.assign(shapes_[k].size(), 1);
  shape.outer_radius.assign(shapes_[k].size(), radius_[k]);
  if (k < wrenches_.size() && wrenches_[k]) {
    shape.loaded = 1;
    std::ranges::copy(*wrenches_[k], shape.wrench.begin());
  }
  return shape;
}

}  // namespace tandem::control_service
