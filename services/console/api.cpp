// SPDX-License-Identifier: Apache-2.0
#include "services/console/api.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "config/arm_names.h"
#include "config/file_tables.h"
#include "config/path.h"
#include "config/units.h"
#include "config/values.h"
#include "kinematics/tasks/task_kind.h"
#include "robots/capability.h"
#include "robots/orientation_freedom.h"
#include "robots/overlap.h"
#include "robots/robot_type.h"
#include "safety/faults.h"
#include "services/console/palette.h"
#include "services/runtime/identity.h"

namespace tandem::console {
namespace {

using Eigen::Isometry3d;
namespace teleoperation = planning::teleoperation;
using Json = nlohmann::ordered_json;

/// JSON has no infinity: null means no limit.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json describePose(const Isometry3d& pose) {
  const Eigen::Quaterniond turn(pose.linear());
  return {{"position", {pose.translation().x(), pose.translation().y(), pose.translation().z()}},
          {"orientation", {turn.x(), turn.y(), turn.z(), turn.w()}}};
}

Json describeTube(const robots::TubeAppearance& tube, const std::string& color) {
  Json sections = Json::array();
  for (const kinematics::TubeSection& section : tube.sections)
    sections.push_back({{"length", section.length}, {"curvature", section.curvature}});
  return {{"name", tube.name},
          {"color", color},
          {"length", tube.length},
          {"outer_radius", tube.outer_radius},
          {"inner_radius", tube.inner_radius},
          {"sections", sections}};
}

Json describeJoints(const config::Arm& arm, const std::vector<robots::JointAppearance>& appearance) {
  const std::vector<std::string> names = arm.joint_names;
  Json joints = Json::array();
  for (std::size_t j = 0; j < names.size(); ++j) {
    const safety::JointLimit& joint = arm.limits.joints[j];
    joints.push_back({{"name", names[j]},
                      {"symbol", appearance[j].symbol},
                      {"title", appearance[j].title},
                      {"part", appearance[j].part},
                      {"translation", arm.limits.isTranslation(static_cast<int>(j))},
                      {"lower", finite(joint.lower)},
                      {"upper", finite(joint.upper)},
                      {"velocity", finite(joint.velocity)},
                      {"stop_deceleration", finite(joint.stop_deceleration)}});
  }
  return joints;
}

Json describeArm(const config::Arm& arm, int index, const robots::ArmAppearance& appearance) {
  Json tubes = Json::array();
  const int count = static_cast<int>(appearance.tubes.size());
  for (int k = 0; k < count; ++k)
    tubes.push_back(describeTube(appearance.tubes[static_cast<std::size_t>(k)], tubeColor(index, k, count)));
  return {{"name", arm.name},
          {"color", armColor(index)},
          {"type", appearance.type},
          {"joint_count", arm.jointCount()},
          {"tubes", std::move(tubes)},
          {"joints", describeJoints(arm, appearance.joints)},
          {"home", std::vector<double>(arm.home.begin(), arm.home.end())},
          {"base", describePose(appearance.base)},
          {"tool", describePose(appearance.tool)}};
}

Json describeArms(const config::Robot& robot) {
  Json arms = Json::array();
  for (int k = 0; k < static_cast<int>(robot.arms.size()); ++k)
    arms.push_back(describeArm(robot.arms[static_cast<std::size_t>(k)], k, robots::typeOf(robot).appearance(robot, k)));
  return arms;
}

/// The grasped object and its contacts with the arms; null if there is none.
Json describeObject(const config::Robot& robot) {
  const config::GraspedObject* object = robots::typeOf(robot).graspedObject(robot);
  if (object == nullptr)
    return nullptr;
  Json contacts = Json::array();
  for (std::size_t k = 0; k < object->contacts.size(); ++k) {
    contacts.push_back({{"arm", robot.arms[k].name},
                        {"type", nameOf(object->contacts[k].type)},
                        {"frame", describePose(object->contacts[k].frame)},
                        {"hand", describePose(object->contacts[k].hand)}});
  }
  return {{"size", object->size}, {"color", objectColor()}, {"contacts", contacts}};
}

Json describeCapabilities(const config::Robot& robot) {
  return {{"tips", has(robot, robots::Capability::kTips)},
          {"common_path", has(robot, robots::Capability::kCommonPath)},
          {"computation", has(robot, robots::Capability::kComputation)}};
}

/// "rad/s"; empty for a plain number.
std::string siUnitOf(config::Quantity quantity) {
  for (const config::Unit* unit : config::unitsOf(quantity)) {
    if (unit->numerator == unit->denominator)
      return unit->forPeople();
  }
  return "";
}

/// @param key  of the files in which the parameter has its meaning and quantity
Json describeParameter(const config::Field& key, double value, const control::TunableParameter& parameter) {
  Json readers = Json::array();
  for (const auto& [method, name, meaning] : idl::Enumeration<control::Method>::entries) {
    if (parameter.readBy(method))
      readers.push_back(name);
  }
  return {{"name", key.name},
          {"value", value},
          {"unit", siUnitOf(key.quantity)},
          {"meaning", key.description},
          {"methods", std::move(readers)}};
}

Json describeControl(const config::Deployment& deployment, const config::Robot& robot) {
  constexpr control::TunableParameter kGain{};  // all methods use the gains
  const config::Mapping& run = config::deploymentTable();
  const config::Mapping& methods = *config::robotTable().field("control").mapping;
  Json parameters = {describeParameter(run.field("relative_gain"), deployment.relative_gain, kGain),
                     describeParameter(run.field("tip_gain"), deployment.tip_gain, kGain)};
  for (const control::TunableParameter& parameter : control::kTunableParameters)
    parameters.push_back(
        describeParameter(methods.field(parameter.name), robot.parameters.*parameter.member, parameter));
  return {{"method", control::name(deployment.method)},
          {"method_library", deployment.method_library.filename().string()},
          {"parameters", parameters},
          {"period", deployment.control_period},
          {"model", deployment.model}};
}

Json describeVector(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

Json describeBox(const teleoperation::Box& box) {
  return {{"min", describeVector(box.minimum)}, {"max", describeVector(box.maximum)}};
}

/// Regions that targets of tips do not enter, and the box that they do not leave (null: none).
Json describeRegions(const teleoperation::GuardOptions& guard) {
  struct Describe {
    Json& region;
    void operator()(const teleoperation::Sphere& sphere) const {
      region["sphere"] = {{"center", describeVector(sphere.center)}, {"radius", sphere.radius}};
    }
    void operator()(const teleoperation::HalfSpace& half) const {
      region["half_space"] = {{"point", describeVector(half.point)}, {"normal", describeVector(half.normal)}};
    }
    void operator()(const teleoperation::Box& box) const { region["box"] = describeBox(box); }
  };
  Json forbidden = Json::array();
  for (const teleoperation::ForbiddenRegion& one : guard.forbidden) {
    Json region{{"name", one.name}};
    std::visit(Describe{region}, one.shape);
    forbidden.push_back(region);
  }
  return {{"forbidden", forbidden},
          {"margin", guard.margin},
          {"workspace", guard.workspace ? describeBox(*guard.workspace) : Json(nullptr)}};
}

/// What of the orientation of tips operators command, and why the arms cannot follow each kind (empty: they can).
Json describeTeleoperation(const config::Deployment& deployment, const config::Robot& robot) {
  using teleoperation::TipOrientation;
  std::optional<robots::RobotModel> model;
  if (has(robot, robots::Capability::kTips))
    model.emplace(robot, deployment.model);
  Json refused;
  for (const TipOrientation orientation : {TipOrientation::kAxis, TipOrientation::kFull})
    refused[robots::nameOf(orientation)] =
        model ? robots::orientationRefusal(robot, *model, orientation) : "its arms have no independent tips";
  return {{"orientation", robots::nameOf(deployment.teleoperation.options.rotation.followed)}, {"refused", refused}};
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

/// Name and meaning of every enumeration value in messages; for faults also the remedy.
Json describeEnumerations() {
  Json texts;
  idl::forEachEnumeration([&texts](const char* enumeration, const auto& entries) {
    Json& list = texts[enumeration];
    for (const auto& [value, name, meaning] : entries) {
      Json& word =
          list.emplace_back(Json{{"value", static_cast<std::uint64_t>(value)}, {"name", name}, {"meaning", meaning}});
      if constexpr (std::is_same_v<decltype(value), const safety::Fault>)
        word["remedy"] = safety::remedy(value);
    }
  });
  return texts;
}

/// Writes the values of a shape by key, SI; nothing for waypoints.
struct DescribeShape {
  Json& all;
  void operator()(const planning::Rectangle& shape) const {
    Json& values = all["rectangle"];
    values["first"] = describeVector(shape.first);
    values["second"] = describeVector(shape.second);
  }
  void operator()(const planning::Lissajous& shape) const {
    Json& values = all["lissajous"];
    values["amplitude"] = describeVector(shape.amplitude);
    values["cycles"] = describeVector(shape.cycles);
    values["phase"] = describeVector(shape.phase);
  }
  void operator()(const planning::Circle& shape) const {
    Json& values = all["circle"];
    values["center_offset"] = describeVector(shape.center_offset);
    values["normal"] = describeVector(shape.normal);
    values["turns"] = shape.turns;
  }
  void operator()(const planning::Line& shape) const {
    all["line"]["displacement"] = describeVector(shape.displacement);
  }
  void operator()(const planning::Waypoints&) const {}
  void operator()(const planning::Insertion& shape) const {
    Json& stages = all["insertion"]["stages"];
    for (const planning::InsertionStage& stage : shape.stages)
      stages.push_back({{"tubes", stage.tubes}, {"length", stage.length}});
  }
};

/// Keys of the tasks beside the tip and the relative position, which the form of the page does not show.
Json describeFurther(const planning::TrajectorySpec& spec) {
  Json names = Json::array();
  for (const planning::FurtherTask& task : spec.further)
    names.push_back(task.follows_leader ? "follow_the_leader" : std::string(kinematics::findTaskKind(task.kind)->name));
  return names;
}

/// Description of a trajectory for the form of the page.
Json describeSpec(const planning::TrajectorySpec& spec) {
  Json shape = Json::object();
  std::visit(DescribeShape{shape}, spec.shape);
  return {{"arm", spec.arm},
          {"other_arm", spec.other_arm},
          {"timed", spec.following == planning::Following::kTimed},
          {"moving", !spec.relative.empty()},
          {"further", describeFurther(spec)},
          {"values",
           {{"points", spec.point_count},
            {"speed", spec.speed},
            {"acceleration", spec.acceleration},
            {"tolerance", spec.tolerance},
            {"max_iterations", spec.max_iterations}}},
          {"shape", shape}};
}

}  // namespace

Json describeRobot(const config::Deployment& deployment, const config::Robot& robot) {
  Json port = nullptr;
  if (deployment.port)
    port = {{"frame", describePose(deployment.port->frame)},
            {"radius", deployment.port->radius},
            {"depth", deployment.port->depth}};
  return {{"deployment", deployment.name},
          {"prefix", deployment.prefix},
          {"robot", robot.name},
          {"fingerprint", config::fingerprintText(runtime::fingerprintOf(deployment))},
          {"frame", deployment.prefix + "_base"},
          {"hardware", robot.hardware || !deployment.hardware.empty()},
          {"lock_step", deployment.clock == config::ClockMode::kLockStep},
          {"status_period", deployment.status_period},
          {"warnings", robots::describeHomeOverlaps(robot, deployment.model)},
          {"secured", !deployment.security.empty()},
          {"capabilities", describeCapabilities(robot)},
          {"arms", describeArms(robot)},
          {"object", describeObject(robot)},
          {"port", port},
          {"regions", describeRegions(deployment.teleoperation.options.guard)},
          {"teleoperation", describeTeleoperation(deployment, robot)},
          {"control", describeControl(deployment, robot)},
          {"budgets", describeBudgets(deployment)},
          {"descriptions", describeEnumerations()}};
}

Json describeTrajectories(const config::Robot& robot) {
  Json all = Json::array();
  const auto add = [&all](const std::filesystem::path& file, const std::string& name, const std::string& yaml,
                          const Json& spec, const std::string& refused = {}) {
    all.push_back({{"name", name},
                   {"summary", config::validate(file).text},
                   {"yaml", yaml},
                   {"spec", spec},
                   {"refused", refused}});
  };
  const bool paths = has(robot, robots::Capability::kCommonPath);
  for (const auto& file : config::presets(paths ? "path" : "trajectory")) {
    try {
      if (paths) {
        const planning::ObjectPath path = config::loadPath(file);
        add(file, path.name, config::formatPath(path), nullptr);
      } else {
        planning::TrajectorySpec spec = config::loadTrajectory(file);
        const std::string wrong = config::findArms(spec, robot);
        add(file, spec.name, config::formatTrajectory(spec), describeSpec(spec), wrong);
      }
    } catch (const config::Error& error) {
      spdlog::warn("{}", error.what());
    }
  }
  return all;
}

}  // namespace tandem::console
