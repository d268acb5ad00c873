// SPDX-License-Identifier: Apache-2.0
#include "config/planar.h"

#include "config/detail/arm_tables.h"
#include "config/detail/bind.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

using enum Quantity;

const Mapping kLinkTable{
    "link",
    "One rigid link.",
    {
        positive("length", kLength, "distance from the link's joint to the next one", &PlanarLink::length).required(),
        positive("diameter", kLength, "diameter of the link", &PlanarLink::diameter).required(),
    }};

const Mapping& turnTable() {
  using safety::JointLimit;
  static const Mapping table = [] {
    Mapping limits{"planar_limits",
                   "Limits of every joint of the arm.",
                   {number("lower", kAngle, "smallest position", &JointLimit::lower).required(),
                    number("upper", kAngle, "largest position", &JointLimit::upper).required()}};
    for (const Field& field : motionLimits(true))
      limits.fields.push_back(field);
    return limits;
  }();
  return table;
}

const Mapping& planarArmTable() {
  static const Mapping table{
      "planar_arm",
      "An arm of two to four links in a plane.",
      {
          bound(armName(), &Arm::name),
          mapping("base", poseTable(), "arm base in the robot base frame; links turn about its z axis"),
          mapping("links", kLinkTable, "from the base to the tip").required().list(2, kinematics::kMaxBodySections),
          mapping("limits", turnTable(), "joint limits").required(),
          number("home", kAngle, "joints at home, one value a link").required().list(2, kinematics::kMaxBodySections),
      }};
  return table;
}

Arm readPlanarArm(const Map& map, PlanarArm& planar) {
  auto arm = map.read<Arm>();
  planar.base = readPose(map.map("base"));
  map.each("links", [&](const Map& link) { link.read(planar.links.emplace_back()); });
  const Map limits = map.map("limits");
  limits.expectBelow("lower", "upper");
  auto limit = limits.read<safety::JointLimit>();
  limit.kind = safety::JointKind::kRotation;
  const int count = static_cast<int>(planar.links.size());
  const std::vector<double> home = map.numbers("home", count);
  for (int j = 0; j < count; ++j) {
    const double q = home[static_cast<std::size_t>(j)];
    if (q < limit.lower || q > limit.upper)
      map.fail("home",
               "found " + map.inUnit("home", q) + ", expected " + map.inUnit("home", limit.lower) + " to " +
                   map.inUnit("home", limit.upper) + ", the limits of this joint",
               j);
    arm.limits.joints.push_back(limit);
    arm.joint_names.push_back("turn_" + std::to_string(j + 1));
  }
  arm.home = Eigen::VectorXd::Map(home.data(), count);
  return arm;
}

}  // namespace

const Mapping& planarTable() {
  static const Mapping table{
      "planar",
      "A robot of planar arms: the example of docs/own-robot-type.md.",
      {
          kindField("planar"),
          text("name", "name of the robot", &Robot::name).required(),
          mapping("arms", planarArmTable(), "the arms, in the order of all joint vectors")
              .required()
              .list(1, safety::kMaxArms),
          mapping("control", controlTable(), "default parameters of the methods", &Robot::parameters),
      }};
  return table;
}

Robot loadPlanarRobot(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(planarTable());
  Robot robot = map.read<Robot>();
  robot.type = "planar";
  robot.file = file;
  auto planar = std::make_shared<PlanarRobot>();
  readArms(map, [&](const Map& arm) { robot.arms.push_back(readPlanarArm(arm, planar->arms.emplace_back())); });
  robot.data = std::move(planar);
  document.finish();
  robot.warnings = document.warnings();
  return robot;
}

void checkPlanarDeployment(const Map& map, const Deployment& deployment) {
  if (deployment.model != "rigid")
    map.fail("model", "found '" + deployment.model + "' for the planar arms of " +
                          deployment.robot.filename().string() + ", expected rigid");
}

}  // namespace tandem::config
