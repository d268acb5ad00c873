// SPDX-License-Identifier: Apache-2.0
#include "config/file_tables.h"
#include "config/loaders.h"

namespace tandem::config {
namespace {

using enum Quantity;
namespace teleoperation = planning::teleoperation;

constexpr int kMostRegions = 16;
constexpr int kMostPathPoints = 1000;

const Mapping& sphereTable() {
  static const Mapping table{"sphere",
                             "A ball, in the robot base frame.",
                             {
                                 number("center", kLength, "x, y, z").required().vector3(),
                                 number("radius", kLength, "of the ball").required().above(0),
                             }};
  return table;
}

const Mapping& halfSpaceTable() {
  static const Mapping table{
      "half_space",
      "Everything behind a plane, in the robot base frame.",
      {
          number("point", kLength, "x, y, z of any point of the plane").required().vector3(),
          number("normal", kNone, "out of the forbidden side; of any length").required().vector3(),
      }};
  return table;
}

const Mapping& boxTable() {
  static const Mapping table{"box",
                             "A box along the axes of the robot base frame.",
                             {
                                 number("min", kLength, "its smallest x, y, z").required().vector3(),
                                 number("max", kLength, "its largest x, y, z").required().vector3(),
                             }};
  return table;
}

const Mapping& regionTable() {
  static const Mapping table{
      "forbidden_region",
      "A region that no tip is sent into by operators or CRTK clients: one of sphere, half_space and box.",
      {
          text("name", "unique in the file; what operators read")
              .required()
              .matching("^[a-z][a-z0-9_-]*$", "a name of small letters, digits, _ and -, a letter first"),
          mapping("sphere", sphereTable(), "a ball").defaultNote("none"),
          mapping("half_space", halfSpaceTable(), "everything behind a plane").defaultNote("none"),
          mapping("box", boxTable(), "a box").defaultNote("none"),
      },
      false,
      {{"sphere"}, {"half_space"}, {"box"}}};
  return table;
}

const Mapping& guidanceTable() {
  static const Mapping table{
      "guidance",
      "A path that operators are led along: motion away from it is weakened.",
      {
          number("points", kLength, "x, y, z of each, robot base frame").required().rows(3).list(2, kMostPathPoints),
          number("strength", kNone, "0: nothing is weakened; 1: nothing leads away").within(0, 1).defaultsTo(0.8),
          number("radius", kLength, "farther away there is no guidance").above(0).defaultsTo(10e-3),
      }};
  return table;
}

const Mapping& crtkTable() {
  const Crtk defaults;
  static const Mapping table{
      "crtk",
      "CRTK commands of clients that know no lease.",
      {
          flag("commands", "false: there are no command topics, and nobody has to find their fifty readers")
              .defaultsTo(1.0),
          text("stamps",
               "how old a command is: by its stamp, on wall clocks that agree; or by how much later than the quickest "
               "one of its stream it comes")
              .oneOf({"wall", "arrival"})
              .defaultsTo("wall"),
          number("tip_step", kLength, "servo_cp and servo_cr: largest step of a target")
              .above(0)
              .defaultsTo(defaults.tip_step),
          number("translation_step", kLength, "servo_jp and servo_jr: likewise, of translations")
              .above(0)
              .defaultsTo(defaults.translation_step),
          number("rotation_step", kAngle, "likewise, of rotations").above(0).defaultsTo(defaults.rotation_step),
          number("acceleration", kAcceleration, "of targets, interpolate and move")
              .above(0)
              .defaultsTo(defaults.acceleration),
      }};
  return table;
}

teleoperation::Box readBox(const Map& map) {
  teleoperation::Box box{map.vector3("min"), map.vector3("max")};
  if (!(box.minimum.array() < box.maximum.array()).all())
    map.fail("max", "found a value that is not above that of min, expected a box with an inside");
  return box;
}

teleoperation::ForbiddenRegion readRegion(const Map& map) {
  teleoperation::ForbiddenRegion region{map.text("name"), teleoperation::Sphere{}};
  if (map.has("sphere")) {
    const Map sphere = map.map("sphere");
    region.shape = teleoperation::Sphere{sphere.vector3("center"), sphere.number("radius")};
  } else if (map.has("half_space")) {
    const Map half = map.map("half_space");
    const Eigen::Vector3d normal = half.vector3("normal");
    if (!(normal.norm() > 0.0))
      half.fail("normal", "found a vector of length 0, expected a direction");
    region.shape = teleoperation::HalfSpace{half.vector3("point"), normal.normalized()};
  } else {
    region.shape = readBox(map.map("box"));
  }
  return region;
}

teleoperation::Guidance readGuidance(const Map& map) {
  teleoperation::Guidance guidance{map.points("points"), map.number("strength"), map.number("radius")};
  for (std::size_t i = 0; i + 1 < guidance.points.size(); ++i) {
    if (!((guidance.points[i + 1] - guidance.points[i]).norm() > 0.0))
      map.fail("points", "found the same point twice in a row, expected different ones", static_cast<int>(i + 1));
  }
  return guidance;
}

}  // namespace

const Mapping& teleoperationTable() {
  const teleoperation::Options o;
  static const Mapping table{
      "teleoperation",
      "How operators' devices and CRTK clients move tips (docs/teleoperation.md).",
      {
          number("scale", kNone, "of the device's motion, unless its client asks for another one")
              .within(teleoperation::kMinScale, teleoperation::kMaxScale)
              .defaultsTo(o.scale),
          number("scale_rate", kGain, "at which the scale changes").above(0).defaultsTo(o.scale_rate),
          number("deadband_speed", kSpeed, "of devices that say velocities").atLeast(0).defaultsTo(o.deadband_speed),
          number("deadband_distance", kLength, "play of devices that say places")
              .atLeast(0)
              .defaultsTo(o.deadband_distance),
          number("filter_min_cutoff", kFrequency, "One-Euro filter: cutoff at rest")
              .above(0)
              .defaultsTo(o.filter.min_cutoff),
          number("filter_beta", kCurvature, "One-Euro filter: how the cutoff grows with speed, Hz per speed")
              .atLeast(0)
              .defaultsTo(o.filter.beta),
          number("filter_derivative_cutoff", kFrequency, "One-Euro filter: cutoff of the speed")
              .above(0)
              .defaultsTo(o.filter.derivative_cutoff),
          number("max_speed", kSpeed, "of targets").above(0).defaultsTo(o.guard.max_speed),
          number("leash", kLength, "farthest that a target is ahead of its tip").above(0).defaultsTo(o.guard.leash),
          number("response", kTime, "in which a tip follows its target; at least two control periods")
              .above(0)
              .defaultsTo(o.guard.response),
          mapping("workspace", boxTable(), "that targets of tips stay in").defaultNote("unlimited"),
          mapping("forbidden", regionTable(), "where no tip is sent").list(0, kMostRegions).defaultNote("none"),
          number("margin", kLength, "distance that targets keep from forbidden regions")
              .above(0)
              .defaultsTo(o.guard.margin),
          mapping("guidance", guidanceTable(), "a path to be led along").defaultNote("none"),
          mapping("crtk", crtkTable(), "CRTK commands").defaultNote("all defaults"),
      }};
  return table;
}

Teleoperation readTeleoperation(const Map& map) {
  Teleoperation all;
  teleoperation::Options& o = all.options;
  o.scale = map.number("scale");
  o.scale_rate = map.number("scale_rate");
  o.deadband_speed = map.number("deadband_speed");
  o.deadband_distance = map.number("deadband_distance");
  o.filter = {map.number("filter_min_cutoff"), map.number("filter_beta"), map.number("filter_derivative_cutoff")};
  o.guard.max_speed = map.number("max_speed");
  o.guard.leash = map.number("leash");
  o.guard.response = map.number("response");
  o.guard.margin = map.number("margin");
  if (map.has("workspace"))
    o.guard.workspace = readBox(map.map("workspace"));
  if (map.has("forbidden")) {
    for (const Map& entry : map.maps("forbidden")) {
      entry.expectNew("name", entry.text("name"), o.guard.forbidden, &teleoperation::ForbiddenRegion::name);
      o.guard.forbidden.push_back(readRegion(entry));
    }
  }
  if (map.has("guidance"))
    o.guard.guidance = readGuidance(map.map("guidance"));
  const Map crtk = map.map("crtk");
  all.crtk.commands = crtk.flag("commands");
  all.crtk.by_arrival = crtk.text("stamps") == "arrival";
  all.crtk.tip_step = crtk.number("tip_step");
  all.crtk.translation_step = crtk.number("translation_step");
  all.crtk.rotation_step = crtk.number("rotation_step");
  all.crtk.acceleration = crtk.number("acceleration");
  return all;
}

}  // namespace tandem::config
