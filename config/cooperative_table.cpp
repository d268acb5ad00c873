// SPDX-License-Identifier: Apache-2.0
#include "config/arm_tables.h"
#include "config/file_tables.h"
#include "kinematics/grasp/contact.h"

namespace tandem::config {
namespace {

using enum Quantity;

const Mapping& wallTable() {
  static const Mapping table{
      "wall",
      "The cross-section of one end of a catheter as a round tube. Its stiffness in bending follows from Young's "
      "modulus, "
      "or is given as measured; shear, extension and torsion follow from it.",
      {
          number("outer_diameter", kLength, "outer diameter").required().above(0),
          number("inner_diameter", kLength, "of the lumen that the wall encloses, smaller than the outer one")
              .required()
              .atLeast(0),
          number("youngs_modulus", kModulus, "E").above(0).defaultNote("`bending_stiffness`"),
          number("bending_stiffness", kStiffness, "E I").above(0).defaultNote("`youngs_modulus`"),
          number("poisson_ratio", kNone, "nu, in G = E / (2 (1 + nu))").within(0.0, 0.5).defaultsTo(0.4),
          number("torsional_stiffness", kStiffness, "G J").above(0).defaultNote("that of the tube"),
      },
      false,
      {{"youngs_modulus"}, {"bending_stiffness"}}};
  return table;
}

Mapping motionTable(const std::string& name, const std::string& what, bool angle) {
  const Quantity position = angle ? kAngle : kLength;
  Mapping limits{
      name,
      what,
      {number("lower", position, "smallest position").required(),
       number("upper", position, "largest position").required(), speedLimit(angle ? kAngularSpeed : kSpeed)}};
  for (const Field& field : accelerationLimits(angle ? kAngularAcceleration : kAcceleration, angle ? 20.0 : 0.1))
    limits.fields.push_back(field);
  limits.fields.push_back(stepLimit(position));
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
      "What each joint may do.",
      {
          mapping("insertion", insertion, "limits of the insertion").required(),
          mapping("roll", turn, "limits of the roll").required(),
          mapping("bend", turn, "limits of the bend; both signs for a bi-directional one").required(),
      }};
  return table;
}

const Mapping& catheterHomeTable() {
  static const Mapping table{
      "catheter_home",
      "A joint vector inside the limits.",
      {
          number("insertion", kLength, "length in front of the entry point, without the bending end").required(),
          number("roll", kAngle, "0: a positive bend is toward +x of the arm's base").defaultsTo(0.0),
          number("bend", kAngle, "angle between both ends of the bending end").required(),
      }};
  return table;
}

const Mapping& catheterTable() {
  static const Mapping table{
      "catheter",
      "A catheter with a passive proximal end and a distal end that pull wires bend.",
      {
          armName(),
          text("type", "kind of arm").required().oneOf({"catheter"}),
          mapping("base", poseTable(), "arm base (entry point, z into the body) in the robot base frame"),
          mapping("tool", poseTable(), "tool tip in the frame of the bending end's tip: what does not bend there"),
          number("bending_length", kLength, "L, of the distal end").required().above(0),
          number("tendon_offset", kLength, "distance of the pull wires from the axis, less than half the diameter")
              .required()
              .above(0),
          mapping("proximal", wallTable(), "the passive end").required(),
          mapping("distal", wallTable(), "the bending end").required(),
          mapping("limits", catheterLimitsTable(), "joint limits").required(),
          mapping("home", catheterHomeTable(), "home position").required(),
      }};
  return table;
}

const Mapping& contactTable() {
  static const Mapping table{
      "contact",
      "Where an arm's tip holds the object: at the place where the tip is at home.",
      {
          text("arm", "name of an arm; each at most once").required(),
          text("type", "what is passed on: a force along the normal; a force; that and a moment about the normal; all")
              .required()
              .oneOf({"frictionless", "point", "soft_finger", "rigid"}),
          number("normal", kNone, "into the object, object frame; of any length")
              .vector3()
              .defaultNote("from the tip at home to the object's origin"),
          number("friction", kNone, "coefficient").above(0).defaultsTo(0.5),
          number("spin_radius", kLength, "radius at which a moment uses up friction as a force does; of soft_finger")
              .above(0)
              .defaultsTo(1e-3),
      }};
  return table;
}

const Mapping& objectTable() {
  static const Mapping table{
      "object",
      "An object that arms hold together: co-manipulation.",
      {
          number("size", kLength, "of the object: makes lengths comparable to angles").required().above(0),
          number("position", kLength, "[x, y, z] of its origin at home, robot base frame")
              .vector3()
              .defaultNote("the middle of the tips"),
          mapping("contacts", contactTable(), "one an arm").required().list(1, kinematics::grasp::kMaxContacts),
          number("load", kForce, "[x, y, z] on the object at its origin, robot base frame: its weight")
              .vector3()
              .defaultsTo(0.0),
          number("squeeze", kForce, "normal force to be held at each contact").atLeast(0).defaultsTo(0.0),
      }};
  return table;
}

const Mapping& assistanceTable() {
  static const Mapping table{
      "assistance",
      "An assist arm whose tip pushes the base of bending of a target arm.",
      {
          text("target", "name of the arm that is pushed").required(),
          text("assist", "name of the arm that pushes").required(),
          text("contact", "rigid: place and orientation agree; point: the place does, and no moment is passed on")
              .oneOf({"rigid", "point"})
              .defaultsTo("rigid"),
          number("press", kLength, "by which the assist arm's home is inserted beyond touching")
              .atLeast(0)
              .defaultsTo(0.0),
          number("push", kForce, "force along the contact's normal to be held").above(0).defaultNote("that of home"),
          number("tolerance", kLength, "by which the touching tip may be off the target's base of bending")
              .above(0)
              .defaultsTo(3e-3),
      }};
  return table;
}

}  // namespace

const Mapping& cooperativeTable() {
  static const Mapping table{
      "cooperative",
      "A robot of catheters that hold an object together, or of which one pushes the other.",
      {
          text("tandem", "kind and version of the file; the first key").required().oneOf({"cooperative/1"}),
          text("name", "name of the robot").required(),
          mapping("arms", catheterTable(), "the arms").required().list(1, kinematics::grasp::kMaxContacts),
          mapping("object", objectTable(), "what the arms hold").defaultNote("none"),
          mapping("assistance", assistanceTable(), "which arm pushes which").defaultNote("none"),
          mapping("control", controlTable(), "default parameters of the methods"),
      }};
  return table;
}

}  // namespace tandem::config
