// SPDX-License-Identifier: Apache-2.0
#include "config/detail/arm_tables.h"
#include "config/detail/bind.h"
#include "config/file_tables.h"
#include "kinematics/concentric_tube.h"
#include "safety/dimensions.h"
#include "safety/limits.h"

namespace tandem::config {
namespace {

using enum Quantity;
using kinematics::Tube;
using kinematics::TubeSection;
using safety::JointLimit;

constexpr auto kTorsionMeaning =
    "tau of a helical tube: toward the tip, the direction in which it bends turns about its own axis by so many "
    "radians per length; positive for a right-handed helix";

const Mapping kSectionTable{
    "section",
    "Section of a tube with constant properties. Give stiffnesses if they do not follow from "
    "the cross-section (cut patterns, other materials).",
    {
        positive("length", kLength, "length", &TubeSection::length).required(),
        number("curvature",
               kCurvature,
               "kappa; positive bends toward +x of the arm's base at alpha = 0",
               &TubeSection::curvature)
            .required(),
        number("torsion", kCurvature, kTorsionMeaning, &TubeSection::helix_torsion).defaultsTo(0.0),
        positive("bending_stiffness", kStiffness, "E I", &TubeSection::bending_stiffness)
            .defaultNote("E times I of the cross-section"),
        positive("torsional_stiffness", kStiffness, "G J", &TubeSection::torsional_stiffness)
            .defaultNote("G times J of the cross-section"),
    }};

const Mapping kTubeTable{
    "tube",
    "One tube: either a straight part and then a curved one (`straight_length`, `curved_length`, `curvature`), or "
    "`sections`.",
    {
        positive("outer_diameter",
                 kLength,
                 "outer diameter, smaller than the next tube's inner one",
                 &Tube::outer_diameter)
            .required()
            .usually(0.2e-3, 20e-3),
        notNegative("inner_diameter",
                    kLength,
                    "inner diameter, smaller than the outer one; 0 for a wire",
                    &Tube::inner_diameter)
            .required(),
        positive("youngs_modulus", kModulus, "E", &Tube::youngs_modulus).required().usually(1e9, 300e9),
        number("poisson_ratio",
               kNone,
               "nu; serves only in G = E / (2 (1 + nu)); above 0.5 with a warning",
               &Tube::poisson_ratio)
            .required()
            .above(-1),
        positive("straight_length", kLength, "L_s, from the proximal end").defaultNote("`sections`").usually(1e-3, 2.0),
        positive("curved_length", kLength, "L_c, at the tip; each tube is longer than the next")
            .defaultNote("`sections`")
            .usually(1e-3, 1.0),
        number("curvature", kCurvature, "kappa; positive bends toward +x of the arm's base at alpha = 0")
            .defaultNote("`sections`")
            .usually(0.1, 200.0),
        number("torsion", kCurvature, kTorsionMeaning).defaultsTo(0.0).usually(0.1, 200.0),
        mapping("sections", kSectionTable, "sections of constant properties, from the proximal end to the tip")
            .list(1, kinematics::kMaxTubeSections)
            .defaultNote("a straight and a curved one"),
    },
    false,
    {{"straight_length", "curved_length", "curvature"}, {"sections"}}};

const Mapping kTranslationTable{"translation_limits", "Limits of every linear stage.", motionLimits(false)};

const Mapping kRotationTable = [] {
  Mapping limits{"rotation_limits",
                 "Limits of every rotation.",
                 {number("lower", kAngle, "smallest angle; finite for hardware", &JointLimit::lower).orUnlimited(),
                  number("upper", kAngle, "largest angle; finite for hardware", &JointLimit::upper).orUnlimited()}};
  for (const Field& field : motionLimits(true))
    limits.fields.push_back(field);
  return limits;
}();

const Mapping kLimitsTable{
    "limits",
    "Equation (1) of Alsaka et al. 2024 with margins, and the limits of each joint. n = number of tubes.",
    {
        notNegative("carriage_spacing", kLength, "smallest distance of neighbouring carriages; one value or n - 1")
            .list(1, 3)
            .orScalar()
            .defaultsTo(0.0),
        notNegative("minimum_extension",
                    kLength,
                    "smallest length by which a tube's tip stays ahead of the next one's; one value or n - 1")
            .list(1, 3)
            .orScalar()
            .defaultsTo(0.0),
        number("stage_minimum", kLength, "smallest beta that each linear stage reaches; n values")
            .list(2, 4)
            .defaultNote("-l_i, the tube's length"),
        number("stage_maximum", kLength, "largest beta that each linear stage reaches; n values")
            .list(2, 4)
            .defaultNote("0"),
        mapping("translation", kTranslationTable, "limits of every linear stage"),
        mapping("rotation", kRotationTable, "limits of every rotation"),
    }};

const Mapping kHomeTable{"home",
                         "A joint vector inside the limits, tube 1 (innermost) first.",
                         {
                             number("beta", kLength, "translations, n values, not positive").required().list(2, 4),
                             number("alpha", kAngle, "rotations, n values").required().list(2, 4),
                         }};

const Mapping kArmTable{
    "arm",
    "One arm of concentric tubes.",
    {
        bound(armName(), &Arm::name),
        text("type", "kind of arm").required().oneOf({"concentric_tubes"}),
        mapping("base", poseTable(), "arm base (entry point, z into the body) in the robot base frame"),
        mapping("tool", poseTable(), "tool tip in the end frame of tube 1"),
        mapping("tubes", kTubeTable, "from the innermost, longest tube outwards").required().list(2, 4),
        mapping("limits", kLimitsTable, "joint limits"),
        mapping("home", kHomeTable, "home position").defaultNote("the middle of equation (1), alpha = 0 where allowed"),
    }};

}  // namespace

const Mapping& robotTable() {
  static const Mapping table{
      "robot",
      "A robot: its arms, their limits, and the default parameters of its controller.",
      {
          kindField("robot"),
          text("name", "name of the robot", &Robot::name).required(),
          flag("hardware", "true: a real robot; refused without finite velocity and rotation limits", &Robot::hardware),
          mapping("arms", kArmTable, "the arms, in the order of all joint vectors")
              .required()
              .list(1, safety::kMaxArms),
          mapping("control", controlTable(), "default parameters of the methods", &Robot::parameters),
      }};
  return table;
}

}  // namespace tandem::config
