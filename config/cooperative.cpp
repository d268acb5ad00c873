// SPDX-License-Identifier: Apache-2.0
#include "config/cooperative.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::grasp::Contact;
namespace assist = kinematics::assist;
namespace catheter = kinematics::catheter;
namespace cosserat = kinematics::cosserat;

cosserat::Section readWall(const Map& map) {
  const double outer = map.number("outer_diameter"), inner = map.number("inner_diameter");
  checkWall(map, outer, inner);
  const double second_moment = std::numbers::pi * (std::pow(outer, 4) - std::pow(inner, 4)) / 64.0;
  const double modulus =
      map.has("youngs_modulus") ? map.number("youngs_modulus") : map.number("bending_stiffness") / second_moment;
  // The length is not used: the model sets it.
  cosserat::Section section = cosserat::tubeSection(1.0, outer, inner, modulus, map.number("poisson_ratio"));
  if (map.has("torsional_stiffness"))
    section.moment_stiffness.z() = map.number("torsional_stiffness");
  return section;
}

safety::ArmLimits readCatheterLimits(const Map& limits) {
  safety::ArmLimits arm;
  for (const char* key : kCatheterJoints) {
    const Map map = limits.map(key);
    auto limit = map.read<safety::JointLimit>();
    const bool insertion = key == kCatheterJoints[0];
    limit.kind = insertion ? safety::JointKind::kTranslation : safety::JointKind::kRotation;
    map.expectBelow("lower", "upper");
    if (insertion && limit.lower < 0.0)
      map.fail("lower", "found " + map.inUnit("lower", limit.lower) + ", expected none below zero");
    arm.joints.push_back(limit);
  }
  return arm;
}

Eigen::VectorXd readHome(const Map& map, const safety::ArmLimits& limits) {
  Eigen::VectorXd q(kinematics::catheter::kJoints);
  for (int j = 0; j < q.size(); ++j) {
    const char* key = kCatheterJoints[j];
    const safety::JointLimit& limit = limits.joints[static_cast<std::size_t>(j)];
    q[j] = map.number(key);
    if (q[j] < limit.lower || q[j] > limit.upper) {
      map.fail(key, "found " + map.inUnit(key, q[j]) + ", expected " + map.inUnit(key, limit.lower) + " to " +
                        map.inUnit(key, limit.upper) + ", the limits of this joint");
    }
  }
  return q;
}

CatheterArm readCatheter(const Map& map) {
  auto arm = map.read<CatheterArm>();
  arm.model.arm.base = readPose(map.map("base"));
  arm.model.arm.tool = readPose(map.map("tool"));
  arm.model.proximal = readWall(map.map("proximal"));
  arm.model.distal = readWall(map.map("distal"));
  arm.outer_diameter = map.map("distal").number("outer_diameter");
  const double radius = 0.5 * arm.outer_diameter;
  if (arm.tendon_offset >= radius) {
    map.fail("tendon_offset", "found " + map.inUnit("tendon_offset", arm.tendon_offset) +
                                  ", expected less than half the outer diameter of the bending end, " +
                                  map.inUnit("tendon_offset", radius));
  }
  if (arm.wire_stiffness > 0.0) {
    catheter::ElasticArm& model = arm.model;
    if (model.actuation != catheter::Actuation::kDisplacement) {
      map.fail("wire_stiffness",
               "found it with `actuation: tension`, expected `actuation: displacement`: at a given "
               "tension the stretch of the wires has no effect");
    }
    model.wire_elasticity = model.distal.moment_stiffness.x() /
                            (arm.wire_stiffness * arm.tendon_offset * arm.tendon_offset * model.arm.bending_length);
  }
  arm.limits = readCatheterLimits(map.map("limits"));
  arm.home = readHome(map.map("home"), arm.limits);
  return arm;
}

int armOf(const Map& map, const std::string& key, const CooperativeRobot& robot) {
  std::vector<std::string> names;
  for (const CatheterArm& arm : robot.arms)
    names.push_back(arm.name);
  return static_cast<int>(map.indexAmong(key, names, "an arm of this robot: " + join(names)));
}

Isometry3d tipAtHome(const CatheterArm& arm) {
  kinematics::Tip tip;
  kinematics::catheter::ConstantCurvature(arm.model.arm).tip(arm.home, tip);
  return tip.pose;
}

/// Contact frame of an arm whose tip touches the object at home.
Contact readContact(const Map& map, const Isometry3d& object, const Isometry3d& tip) {
  auto contact = map.read<Contact>();
  const Vector3d place = object.inverse() * tip.translation();
  const Vector3d normal = map.has("normal") ? map.vector3("normal") : Vector3d(-place);
  if (normal.norm() < 1e-9) {
    map.fail("normal",
             std::string(map.has("normal") ? "found a zero vector" : "found none") +
                 ", expected a vector other than zero; it is required where the tip is at the object's origin");
  }
  contact.frame = Eigen::Translation3d(place) * Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal);
  contact.hand = tip.inverse() * object * contact.frame;
  return contact;
}

GraspedObject readObject(const Map& map, const CooperativeRobot& robot) {
  auto object = map.read<GraspedObject>();
  Vector3d middle = Vector3d::Zero();
  const std::vector<Map> contacts = map.maps("contacts");
  for (const Map& contact : contacts) {
    const int arm = armOf(contact, "arm", robot);
    if (std::ranges::find(object.arms, arm) != object.arms.end())
      contact.fail("arm", "found '" + contact.text("arm") + "' a second time, expected each arm at most once");
    object.arms.push_back(arm);
    middle += tipAtHome(robot.arms[static_cast<std::size_t>(arm)]).translation() / static_cast<double>(contacts.size());
  }
  object.pose.translation() = map.has("position") ? map.vector3("position") : middle;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const CatheterArm& arm = robot.arms[static_cast<std::size_t>(object.arms[k])];
    object.contacts.push_back(readContact(contacts[k], object.pose, tipAtHome(arm)));
  }
  return object;
}

Assistance readAssistance(const Map& map, const CooperativeRobot& robot) {
  auto relation = map.read<Assistance>();
  relation.target = armOf(map, "target", robot);
  relation.assist = armOf(map, "assist", robot);
  if (relation.target == relation.assist)
    map.fail("assist", "found '" + map.text("assist") + "', which is the target, expected another arm");
  const CatheterArm& target = robot.arms[static_cast<std::size_t>(relation.target)];
  const CatheterArm& pusher = robot.arms[static_cast<std::size_t>(relation.assist)];
  relation.pair.target = target.model;
  relation.pair.assist = pusher.model;
  assist::Joints touching;
  touching << target.home, pusher.home;
  touching[3] -= relation.press;
  if (touching[3] < 0.0) {
    map.fail("press", "found " + map.inUnit("press", relation.press) + ", expected at most " +
                          map.inUnit("press", pusher.home[0]) + ", the insertion of the assist arm at home");
  }
  if (touching[0] <= 0.0) {
    map.fail("target", "found '" + map.text("target") + "', whose insertion at home is " +
                           map.inUnit("press", touching[0]) + ", expected an arm with an insertion above zero");
  }
  relation.pair.contact = assist::TargetAssist::touching(relation.pair, touching);
  const double off = relation.pair.contact.translation().norm(), tolerance = map.number("tolerance");
  if (off > tolerance) {
    map.fail("assist", "found a tip that is " + map.inUnit("tolerance", off) +
                           " from the target's base of bending at home less `press`, expected at most " +
                           map.inUnit("tolerance", tolerance));
  }
  try {
    assist::TargetAssist checked(relation.pair);
  } catch (const std::invalid_argument& error) {
    map.fail("contact", "found a pair that the model does not support: " + std::string(error.what()));
  }
  return relation;
}

}  // namespace

assist::Range CooperativeRobot::range() const {
  assist::Range range;
  const Assistance& relation = assistance.value();
  for (const auto& [arm, first] : {std::pair{relation.target, 0}, {relation.assist, 3}}) {
    for (int j = 0; j < kinematics::catheter::kJoints; ++j) {
      const auto& limit = arms[static_cast<std::size_t>(arm)].limits.joints[static_cast<std::size_t>(j)];
      range.lower[first + j] = limit.lower;
      range.upper[first + j] = limit.upper;
    }
  }
  return range;
}

assist::Joints CooperativeRobot::home() const {
  assist::Joints q;
  const Assistance& relation = assistance.value();
  q << arms[static_cast<std::size_t>(relation.target)].home, arms[static_cast<std::size_t>(relation.assist)].home;
  return q;
}

CooperativeRobot loadCooperative(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(cooperativeTable());
  auto robot = map.read<CooperativeRobot>();
  robot.file = file;
  readArms(map, [&](const Map& arm) {
    robot.arms.push_back(readCatheter(arm));
    try {
      kinematics::catheter::ElasticCatheter checked(robot.arms.back().model);
    } catch (const std::invalid_argument& error) {
      arm.fail("name", "found an arm that the model does not support: " + std::string(error.what()));
    }
  });
  map.together(
      [&] {
        if (map.has("object"))
          robot.object = readObject(map.map("object"), robot);
      },
      [&] {
        if (map.has("assistance"))
          robot.assistance = readAssistance(map.map("assistance"), robot);
      });
  document.finish();
  robot.warnings = document.warnings();
  return robot;
}

}  // namespace tandem::config
