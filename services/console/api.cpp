// SPDX-License-Identifier: Apache-2.0
#include "services/console/api.h"

#include <spdlog/spdlog.h>

#include <cmath>

namespace tandem::console {
namespace {

using Json = nlohmann::ordered_json;

/// JSON knows no infinity: what has no limit is null.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json describePose(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond turn(pose.linear());
  return {{"position", {pose.translation().x(), pose.translation().y(), pose.translation().z()}},
          {"orientation", {turn.x(), turn.y(), turn.z(), turn.w()}}};
}

Json describeTube(const kinematics::Tube& tube) {
  Json sections = Json::array();
  for (const kinematics::TubeSection& section : tube.sections)
    sections.push_back({{"length", section.length}, {"curvature", section.curvature}});
  return {{"length", tube.length()},
          {"outer_radius", tube.outer_diameter / 2},
          {"inner_radius", tube.inner_diameter / 2},
          {"sections", sections}};
}

Json describeLimits(const safety::ArmLimits& limits) {
  Json joints = Json::array();
  for (const safety::JointLimit& joint : limits.joints)
    joints.push_back({{"lower", finite(joint.lower)},
                      {"upper", finite(joint.upper)},
                      {"velocity", finite(joint.velocity)},
                      {"stop_deceleration", finite(joint.stop_deceleration)}});
  return joints;
}

Json describeArm(const config::Arm& arm) {
  Json tubes = Json::array();
  for (const kinematics::Tube& tube : arm.model.tubes)
    tubes.push_back(describeTube(tube));
  return {{"name", arm.name},
          {"type", "concentric_tube"},
          {"joint_count", arm.model.jointCount()},
          {"tubes", tubes},
          {"joints", describeLimits(arm.limits)},
          {"home", std::vector<double>(arm.home.begin(), arm.home.end())},
          {"base", describePose(arm.model.base)},
          {"tool", describePose(arm.model.tool)}};
}

Json describeControl(const config::Deployment& deployment, const config::Robot& robot) {
  Json methods = Json::array(), parameters = Json::array();
  for (int k = 0; k < control::kMethodCount; ++k)
    methods.push_back(control::name(static_cast<control::Method>(k)));
  for (const control::Tunable& tunable : control::kTunables)
    parameters.push_back({{"name", tunable.name}, {"value", robot.parameters.*tunable.member}});
  return {{"method", control::name(deployment.method)},
          {"methods", methods},
          {"parameters", parameters},
          {"backends", {control::name(control::Backend::kActiveSet), control::name(control::Backend::kIpopt)}},
          {"bounds", {control::name(control::BoundsKind::kCoupled), control::name(control::BoundsKind::kFrozen)}},
          {"period", deployment.control_period},
          {"relative_gain", deployment.relative_gain},
          {"tip_gain", deployment.tip_gain},
          {"model", deployment.model}};
}

Json describeBudgets(const config::Deployment& deployment) {
  const safety::Budgets& budgets = deployment.budgets;
  return {{"command_age", budgets.commandAge(deployment.control_period)},
          {"planning_reference", budgets.planning_reference},
          {"teleoperation", budgets.teleoperation},
          {"tip_measurement", budgets.tipAge(deployment.control_period)},
          {"drive_heartbeat", budgets.drive_heartbeat},
          {"lease", budgets.lease}};
}

}  // namespace

Json describeRobot(const config::Deployment& deployment, const config::Robot& robot) {
  Json arms = Json::array();
  for (const config::Arm& arm : robot.arms)
    arms.push_back(describeArm(arm));
  Json port = nullptr;
  if (deployment.port)
    port = {{"frame", describePose(deployment.port->frame)},
            {"radius", deployment.port->radius},
            {"depth", deployment.port->depth}};
  return {{"deployment", deployment.name},
          {"prefix", deployment.prefix},
          {"robot", robot.name},
          {"frame", deployment.prefix + "_base"},
          {"hardware", robot.hardware || !deployment.hardware.empty()},
          {"lock_step", deployment.clock == config::ClockMode::kLockStep},
          {"status_period", deployment.status_period},
          {"secured", !deployment.security.empty()},
          {"arms", arms},
          {"port", port},
          {"control", describeControl(deployment, robot)},
          {"budgets", describeBudgets(deployment)}};
}

Json describeTrajectories() {
  Json all = Json::array();
  for (const auto& file : config::presets("trajectory")) {
    try {
      const planning::TrajectorySpec spec = config::loadTrajectory(file);
      all.push_back(
          {{"name", spec.name}, {"summary", config::validate(file).text}, {"yaml", config::formatTrajectory(spec)}});
    } catch (const config::Error& error) {
      spdlog::warn("{}", error.what());
    }
  }
  return all;
}

}  // namespace tandem::console
