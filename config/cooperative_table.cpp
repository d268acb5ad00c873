// SPDX-License-Identifier: Apache-2.0
#include "config/cooperative.h"
#include "config/detail/arm_tables.h"
#include "config/detail/bind.h"
#include "config/file_tables.h"
#include "kinematics/grasp/contact.h"

namespace tandem::config {
namespace {

using enum Quantity;
using kinematics::catheter::Actuation;
using kinematics::grasp::Contact;
using kinematics::grasp::ContactType;

const Mapping kWallTable{
    "wall",
    "The cross-section of one end of a catheter as a round tube. Its stiffness in bending follows from Young's "
    "modulus, "
    "or is given as measured; shear, extension and torsion follow from it.",
    {
        positive("outer_diameter", kLength, "outer diameter").required().usually(0.2e-3, 30e-3),
        notNegative("inner_diameter", kLength, "diameter of the lumen, smaller than the outer diameter").required(),
        positive("youngs_modulus", kModulus, "E").defaultNote("`bending_stiffness`").usually(1e6, 300e9),
        positive("bending_stiffness", kStiffness, "E I").defaultNote("`youngs_modulus`"),
        number("poisson_ratio", kNone, "nu, in G = E / (2 (1 + nu))").within(0.0, 0.5).defaultsTo(0.4),
        positive("torsional_stiffness", kStiffness, "G J").defaultNote("that of the tube"),
    },
    false,
    {{"youngs_modulus"}, {"bending_stiffness"}}};

Mapping motionTable(const std::string& name, const std::string& what, bool angle) {
  using safety::JointLimit;
  const Quantity position = angle ? kAngle : kLength;
  Mapping limits{name,
                 what,
                 {number("lower", position, "smallest position", &JointLimit::lower).required(),
                  number("upper", position, "largest position", &JointLimit::upper).required()}};
  for (const Field& field : motionLimits(angle))
    limits.fields.push_back(field);
  return limits;
}

const Mapping& catheterLimitsTable() {
  static const Mapping insertion =
      motionTable("insertion_limits",
                  "Limits of the insertion: length in front of the entry point, without the bending "
                  "end. `lower` is not below zero.",
                  false);
  static const Mapping turn = motionTable("turn_limits", "Limits of a roll or a bend.", true);
  static const Mapping table{
      "catheter_limits",
      "Joint limits of a catheter.",
      {
          mapping("insertion", insertion, "limits of the insertion").required(),
          mapping("roll", turn, "limits of the roll").required(),
          mapping("bend", turn, "limits of the bend; both signs for a bi-directional one").required(),
      }};
  return table;
}

const Mapping kCatheterHomeTable{
    "catheter_home",
    "A joint vector inside the limits.",
    {
        number("insertion", kLength, "length in front of the entry point, without the bending end").required(),
        number("roll", kAngle, "0: a positive bend is toward +x of the arm's base").defaultsTo(0.0),
        number("bend", kAngle, "angle between both ends of the bending end").required(),
    }};

const Mapping kCatheterTable{
    "catheter",
    "A catheter with a passive proximal end and a distal end that pull wires bend.",
    {
        bound(armName(), &CatheterArm::name),
        text("type", "kind of arm").required().oneOf({"catheter"}),
        mapping("base", poseTable(), "arm base (entry point, z into the body) in the robot base frame"),
        mapping("tool", poseTable(), "pose of the tool tip in the frame of the distal end's tip (rigid tip part)"),
        positive("bending_length",
                 kLength,
                 "L, of the distal end",
                 &CatheterArm::model,
                 &kinematics::catheter::ElasticArm::arm,
                 &kinematics::catheter::Arm::bending_length)
            .required(),
        positive("tendon_offset",
                 kLength,
                 "distance of the pull wires from the axis, less than half the diameter",
                 &CatheterArm::tendon_offset)
            .required(),
        text("actuation",
             "what stays constant at a joint while the load changes: displacement: that of the pull wires, their "
             "tension follows; tension: that of the pull wires",
             named({Actuation::kDisplacement, Actuation::kTension}),
             &CatheterArm::model,
             &kinematics::catheter::ElasticArm::actuation),
        positive("wire_stiffness",
                 kSpringStiffness,
                 "k, of a pull wire from the actuator to the bending end, with `actuation: displacement`",
                 &CatheterArm::wire_stiffness)
            .defaultNote("wires do not stretch"),
        mapping("proximal", kWallTable, "the passive end").required(),
        mapping("distal", kWallTable, "the bending end").required(),
        mapping("limits", catheterLimitsTable(), "joint limits").required(),
        mapping("home", kCatheterHomeTable, "home position").required(),
    }};

const Mapping kContactTable{
    "contact",
    "Contact of an arm with the object, at the tip's home position.",
    {
        text("arm", "name of an arm; each at most once").required(),
        text("type",
             "components transmitted: frictionless: normal force; point: force; soft_finger: force and moment about "
             "the normal; rigid: all",
             named({ContactType::kFrictionless, ContactType::kPoint, ContactType::kSoftFinger, ContactType::kRigid}),
             &Contact::type)
            .required(),
        number("normal", kNone, "contact normal into the object, object frame; of any length")
            .vector3()
            .defaultNote("from the tip at home to the object's origin"),
        positive("friction", kNone, "coefficient", &Contact::friction),
        positive("spin_radius",
                 kLength,
                 "equivalent friction radius of a soft finger: torsional moment / radius counts as tangential force",
                 &Contact::spin_radius),
    }};

const Mapping kObjectTable{
    "object",
    "Object grasped by several arms (co-manipulation).",
    {
        positive("size", kLength, "size of the object: makes lengths comparable to angles", &GraspedObject::size)
            .required(),
        number("position", kLength, "[x, y, z] of the object's origin at home, robot base frame")
            .vector3()
            .defaultNote("the middle of the tips"),
        mapping("contacts", kContactTable, "contacts of the arms with the object, one per arm")
            .required()
            .list(1, kinematics::grasp::kMaxContacts),
        number("load",
               kForce,
               "force [x, y, z] on the object at its origin, robot base frame: its weight",
               &GraspedObject::load)
            .vector3(),
        notNegative("squeeze", kForce, "normal force to maintain at each contact", &GraspedObject::squeeze),
    }};

const Mapping kAssistanceTable{
    "assistance",
    "An assist arm whose tip pushes the base of bending of a target arm.",
    {
        text("target", "name of the arm that is pushed").required(),
        text("assist", "name of the arm that pushes").required(),
        text("contact",
             "rigid: position and orientation agree; point: position agrees, no moment is transmitted",
             named({ContactType::kRigid, ContactType::kPoint}),
             &Assistance::pair,
             &kinematics::assist::Pair::type),
        notNegative("press",
                    kLength,
                    "additional insertion of the assist arm at home beyond first contact",
                    &Assistance::press),
        positive("push", kForce, "normal contact force to maintain", &Assistance::push).defaultNote("that of home"),
        positive("tolerance",
                 kLength,
                 "permitted position error of the assist tip relative to the target's base of bending at home")
            .defaultsTo(3e-3),
    }};

}  // namespace

const Mapping& cooperativeTable() {
  static const Mapping table{
      "cooperative",
      "A robot of catheters that grasp a common object, or of which one pushes the other.",
      {
          kindField("cooperative"),
          text("name", "name of the robot", &CooperativeRobot::name).required(),
          mapping("arms", kCatheterTable, "the arms").required().list(1, kinematics::grasp::kMaxContacts),
          mapping("object", kObjectTable, "grasped object").defaultNote("none"),
          mapping("assistance", kAssistanceTable, "target arm, assist arm and their contact").defaultNote("none"),
          mapping("control", controlTable(), "default parameters of the methods", &CooperativeRobot::parameters),
      }};
  return table;
}

}  // namespace tandem::config
