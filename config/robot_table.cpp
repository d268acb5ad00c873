// SPDX-License-Identifier: Apache-2.0
#include "config/arm_tables.h"
#include "config/file_tables.h"
#include "control/parameters.h"
#include "kinematics/concentric_tube.h"
#include "safety/dimensions.h"
#include "safety/limits.h"

namespace tandem::config {
namespace {

using enum Quantity;
constexpr double kUnlimited = safety::kUnlimited;

const Mapping& sectionTable() {
  static const Mapping table{
      "section",
      "A part of a tube over which nothing changes. Stiffnesses of their own say what the cross-section does not: "
      "patterns cut into the wall, another material.",
      {
          number("length", kLength, "length").required().above(0),
          number("curvature", kCurvature, "kappa; positive bends toward +x of the arm's base at alpha = 0").required(),
          number("bending_stiffness", kStiffness, "E I").above(0).defaultNote("E times I of the cross-section"),
          number("torsional_stiffness", kStiffness, "G J").above(0).defaultNote("G times J of the cross-section"),
      }};
  return table;
}

const Mapping& tubeTable() {
  static const Mapping table{
      "tube",
      "One tube: either a straight part and then a curved one (`straight_length`, `curved_length`, `curvature`), or "
      "`sections`.",
      {
          number("outer_diameter", kLength, "outer diameter, smaller than the next tube's inner one")
              .required()
              .above(0),
          number("inner_diameter", kLength, "inner diameter, smaller than the outer one; 0 for a wire")
              .required()
              .atLeast(0),
          number("youngs_modulus", kModulus, "E").required().above(0),
          number("poisson_ratio", kNone, "nu; serves only in G = E / (2 (1 + nu)); above 0.5 with a warning")
              .required()
              .above(-1),
          number("straight_length", kLength, "L_s, from the proximal end").above(0).defaultNote("`sections`"),
          number("curved_length", kLength, "L_c, at the tip; each tube is longer than the next")
              .above(0)
              .defaultNote("`sections`"),
          number("curvature", kCurvature, "kappa; positive bends toward +x of the arm's base at alpha = 0")
              .defaultNote("`sections`"),
          mapping("sections", sectionTable(), "parts between which anything changes, from the proximal end to the tip")
              .list(1, kinematics::kMaxTubeSections)
              .defaultNote("a straight and a curved one"),
      },
      false,
      {{"straight_length", "curved_length", "curvature"}, {"sections"}}};
  return table;
}

const Mapping& translationTable() {
  static const Mapping table = [] {
    Mapping limits{"translation_limits", "Limits of every linear stage.", {speedLimit(kSpeed)}};
    for (const Field& field : accelerationLimits(kAcceleration, 0.1))
      limits.fields.push_back(field);
    limits.fields.push_back(stepLimit(kLength));
    return limits;
  }();
  return table;
}

const Mapping& rotationTable() {
  static const Mapping table = [] {
    Mapping limits{"rotation_limits", "Limits of every rotation.", {}};
    limits.fields.push_back(
        number("lower", kAngle, "smallest angle; finite for hardware").orUnlimited().defaultsTo(-kUnlimited));
    limits.fields.push_back(
        number("upper", kAngle, "largest angle; finite for hardware").orUnlimited().defaultsTo(kUnlimited));
    limits.fields.push_back(speedLimit(kAngularSpeed));
    for (const Field& field : accelerationLimits(kAngularAcceleration, 20.0))
      limits.fields.push_back(field);
    limits.fields.push_back(stepLimit(kAngle));
    return limits;
  }();
  return table;
}

const Mapping& limitsTable() {
  static const Mapping table{
      "limits",
      "Equation (1) of Alsaka et al. 2024 with margins, and what each joint may do. n = number of tubes.",
      {
          number("carriage_spacing", kLength, "smallest distance of neighbouring carriages; one value or n - 1")
              .list(1, 3)
              .orScalar()
              .atLeast(0)
              .defaultsTo(0.0),
          number("minimum_extension", kLength,
                 "smallest length by which a tube's tip stays ahead of the next one's; one value or n - 1")
              .list(1, 3)
              .orScalar()
              .atLeast(0)
              .defaultsTo(0.0),
          number("stage_minimum", kLength, "smallest beta that each linear stage reaches; n values")
              .list(2, 4)
              .defaultNote("-l_i, the tube's length"),
          number("stage_maximum", kLength, "largest beta that each linear stage reaches; n values")
              .list(2, 4)
              .defaultNote("0"),
          mapping("translation", translationTable(), "limits of every linear stage"),
          mapping("rotation", rotationTable(), "limits of every rotation"),
      }};
  return table;
}

const Mapping& homeTable() {
  static const Mapping table{"home",
                             "A joint vector inside the limits, tube 1 (innermost) first.",
                             {
                                 number("beta", kLength, "translations, n values, not positive").required().list(2, 4),
                                 number("alpha", kAngle, "rotations, n values").required().list(2, 4),
                             }};
  return table;
}

const Mapping& armTable() {
  static const Mapping table{
      "arm",
      "One arm of concentric tubes.",
      {
          armName(),
          text("type", "kind of arm").required().oneOf({"concentric_tubes"}),
          mapping("base", poseTable(), "arm base (entry point, z into the body) in the robot base frame"),
          mapping("tool", poseTable(), "tool tip in the end frame of tube 1"),
          mapping("tubes", tubeTable(), "from the innermost, longest tube outwards").required().list(2, 4),
          mapping("limits", limitsTable(), "joint limits"),
          mapping("home", homeTable(), "home position")
              .defaultNote("the middle of equation (1), alpha = 0 where allowed"),
      }};
  return table;
}

}  // namespace

const Mapping& robotTable() {
  static const Mapping table{
      "robot",
      "A robot: its arms, their limits, and the default parameters of its controller.",
      {
          text("tandem", "kind and version of the file; the first key").required().oneOf({"robot/1"}),
          text("name", "name of the robot").required(),
          flag("hardware", "true: a real robot; refused without finite velocity and rotation limits").defaultsTo(0.0),
          mapping("arms", armTable(), "the arms, in the order of all joint vectors")
              .required()
              .list(1, safety::kMaxArms),
          mapping("control", controlTable(), "default parameters of the methods"),
      }};
  return table;
}

}  // namespace tandem::config
