// SPDX-License-Identifier: Apache-2.0
#include "services/computation/problem.h"

#include <cmath>

#include "config/arm_names.h"
#include "control/method_names.h"
#include "planning/insertion.h"

namespace tandem::computation {
namespace {

using msg::ComputationKind;

std::string textOf(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", number);
  return text;
}

[[noreturn]] void refuse(const std::string& key, const std::string& found, const std::string& expected) {
  throw Refusal(msg::ReplyCode::kMalformed, key + ": found " + found + ", expected " + expected);
}

void expectRange(const std::string& key, double value, double least, double most, const std::string& unit) {
  if (!(value >= least && value <= most))
    refuse(key, textOf(value), "a number from " + textOf(least) + " to " + textOf(most) + unit);
}

std::string namesOf(const config::Robot& robot) {
  std::string names;
  for (const config::Arm& arm : robot.arms)
    names += (names.empty() ? "" : ", ") + arm.name;
  return names;
}

}  // namespace

ComputationProblem::ComputationProblem(msg::ComputationRequest wanted,
                                       const ComputationRobot& of,
                                       const std::optional<safety::RobotVector>& present)
    : request(std::move(wanted)),
      robot(of),
      arms{of.model.models(), of.model.limits(), config::shortArmNames(of.robot)} {
  const int kind = request.kind;
  if (kind < static_cast<int>(ComputationKind::kCheck) || kind > static_cast<int>(ComputationKind::kChooseStart))
    throw Refusal(msg::ReplyCode::kUnknown, "kind: found " + std::to_string(kind) + ", expected 1 to 7");
  checkNumbers();
  readRehearsal();
  const auto joints = static_cast<std::size_t>(arms.jointCount());
  if (!request.joints.empty() && request.joints.size() != joints)
    refuse("joints", std::to_string(request.joints.size()), std::to_string(joints) + " of " + namesOf(of.robot));
  for (std::size_t j = 0; j < request.joints.size(); ++j) {
    if (!std::isfinite(request.joints[j]))
      refuse("joints[" + std::to_string(j) + "]", textOf(request.joints[j]), "a finite number, m or rad");
  }
  if (request.joints.empty() && !present)
    throw Refusal(msg::ReplyCode::kWrongState,
                  "joints: found none, expected values: the present joints of the robot are not known (no valid "
                  "actuation/state)");
  start = request.joints.empty() ? *present
                                 : safety::RobotVector(Eigen::Map<const Eigen::VectorXd>(
                                       request.joints.data(), static_cast<Eigen::Index>(joints)));
  if (kind == static_cast<int>(ComputationKind::kInverseKinematics))
    readTargets();
  else
    readTrajectory();
}

void ComputationProblem::checkNumbers() const {
  constexpr double kFar = 1.0, kFast = 1e3;
  expectRange("stability", request.stability, 0.0, 1.0, "");
  expectRange("clearance", request.clearance, 0.0, kFar, " m");
  expectRange("port_radius", request.port_radius, 0.0, kFar, " m");
  expectRange("port_depth", request.port_depth, 0.0, kFar, " m");
  expectRange("accept", request.accept, 0.0, kFar, " m");
  expectRange("starts", request.starts, 0, 1000, "");
  expectRange("tries", request.tries, 0, 10000, "");
  expectRange("smoothing", request.smoothing, 0.0, 1e12, "");
  expectRange("translation_acceleration", request.translation_acceleration, 0.0, kFast, " m/s^2");
  expectRange("rotation_velocity", request.rotation_velocity, 0.0, kFast, " rad/s");
  expectRange("rotation_acceleration", request.rotation_acceleration, 0.0, kFast, " rad/s^2");
  expectRange("time_limit", request.time_limit, 0.0, 3600.0, " s");
}

void ComputationProblem::readRehearsal() {
  const auto method = idl::fromName<control::Method>(request.rehearse);
  const bool known = method && (*method != control::Method::kForeign || robot.robot.parameters.foreign != nullptr);
  if (!request.rehearse.empty() && !known)
    refuse("rehearse", "'" + request.rehearse.substr(0, 40) + "'", control::methodList());
  rehearsal = {method.value_or(rehearsal.method), robot.robot.parameters, robot.gains};
  if (robot.period > 0.0)
    rehearsal.parameters.period = robot.period;
  for (std::size_t k = 0; k < request.parameters.size(); ++k) {
    try {
      rehearsal.set(request.parameters[k].name, request.parameters[k].value);
    } catch (const std::invalid_argument& error) {
      throw Refusal(msg::ReplyCode::kMalformed, "parameters[" + std::to_string(k) + "]: " + error.what());
    }
  }
}

void ComputationProblem::readTargets() {
  if (request.targets.empty() || request.targets.size() > kMostTargets)
    refuse("targets", std::to_string(request.targets.size()), "1 to " + std::to_string(kMostTargets));
  for (std::size_t k = 0; k < request.targets.size(); ++k) {
    const msg::TipTarget& from = request.targets[k];
    const std::string key = "targets[" + std::to_string(k) + "].";
    if (from.arm >= arms.count())
      refuse(key + "arm", std::to_string(from.arm),
             "0 to " + std::to_string(arms.count() - 1) + " for " + namesOf(robot.robot));
    planning::TipTarget target;
    target.arm = from.arm;
    for (const planning::TipTarget& other : targets) {
      if (other.arm == target.arm)
        refuse(key + "arm", std::to_string(from.arm) + " a second time", "one target per arm");
    }
    target.position = Eigen::Vector3d::Map(from.position.data());
    if (!target.position.allFinite())
      refuse(key + "position", "a number that is not finite", "three finite numbers, m");
    if (from.has_direction != 0) {
      const Eigen::Vector3d direction = Eigen::Vector3d::Map(from.direction.data());
      if (!direction.allFinite() || !(direction.norm() > 1e-9) || direction.norm() > 1e9)
        refuse(key + "direction", "a length of " + textOf(direction.norm()), "a finite vector other than zero");
      target.direction = direction.normalized();
    }
    if (from.has_orientation != 0) {
      const Eigen::Quaterniond orientation(Eigen::Vector4d::Map(from.orientation.data()));
      if (target.direction)
        refuse(key + "orientation", "a direction, too", "one of them");
      if (!orientation.coeffs().allFinite() || !(orientation.norm() > 1e-9) || orientation.norm() > 1e9)
        refuse(key + "orientation", "a length of " + textOf(orientation.norm()), "a finite quaternion other than zero");
      target.orientation = orientation.normalized();
    }
    targets.push_back(target);
  }
}

void ComputationProblem::readTrajectory() {
  if (request.trajectory.size() > kLongestTrajectory)
    refuse("trajectory", std::to_string(request.trajectory.size()) + " bytes",
           "at most " + std::to_string(kLongestTrajectory));
  try {
    spec = config::parseTrajectory(request.trajectory, "trajectory", {});  // names no files
  } catch (const std::exception& error) {
    throw Refusal(msg::ReplyCode::kMalformed, error.what());
  }
  if (const std::string wrong = config::findArms(spec, robot.robot); !wrong.empty())
    throw Refusal(msg::ReplyCode::kMalformed, "trajectory: " + wrong + "; " + namesOf(robot.robot));
  if (spec.point_count > kMostPoints && request.kind != static_cast<std::uint8_t>(ComputationKind::kChooseStart))
    refuse("trajectory: points", std::to_string(spec.point_count), "at most " + std::to_string(kMostPoints));
  std::vector<kinematics::Tip> tips(static_cast<std::size_t>(arms.count()));
  for (const int arm : spec.arms()) {
    const Eigen::VectorXd own = start.segment(arms.offset(arm), arms.size(arm));
    const auto k = static_cast<std::size_t>(arm);
    if (arms.models[k]->tip(own, tips[k]) != kinematics::ModelStatus::kOk)
      return;  // defects of the start configuration are part of the report
  }
  try {
    planning::TrajectorySpec coarse = spec.ofPositions();
    coarse.point_count = 1;
    planning::setInsertion(arms, start, coarse);
    const planning::TrajectoryPoint at =
        planning::positionsAt(spec, [&](int arm) { return tips[static_cast<std::size_t>(arm)].pose; });
    planning::sample(coarse, at);
  } catch (const std::invalid_argument& error) {
    throw Refusal(msg::ReplyCode::kMalformed, error.what());
  }
}

}  // namespace tandem::computation
