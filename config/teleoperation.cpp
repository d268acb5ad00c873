// SPDX-License-Identifier: Apache-2.0
#include "config/detail/bind.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

using enum Quantity;
namespace teleoperation = planning::teleoperation;

constexpr int kMostRegions = 16;
constexpr int kMostPathPoints = 1000;

const Mapping kSphereTable{
    "sphere",
    "A sphere, in the robot base frame.",
    {
        number("center", kLength, "x, y, z of the centre", &teleoperation::Sphere::center).required().vector3(),
        positive("radius", kLength, "radius of the sphere", &teleoperation::Sphere::radius).required(),
    }};

const Mapping kHalfSpaceTable{
    "half_space",
    "Everything behind a plane, in the robot base frame.",
    {
        number("point", kLength, "x, y, z of any point of the plane", &teleoperation::HalfSpace::point)
            .required()
            .vector3(),
        number("normal",
               kNone,
               "normal of the plane, out of the forbidden side; of any length",
               &teleoperation::HalfSpace::normal)
            .required()
            .vector3(),
    }};

const Mapping kBoxTable{
    "box",
    "A box along the axes of the robot base frame.",
    {
        number("min", kLength, "smallest x, y, z of the box", &teleoperation::Box::minimum).required().vector3(),
        number("max", kLength, "largest x, y, z of the box", &teleoperation::Box::maximum).required().vector3(),
    }};

const Mapping kRegionTable{
    "forbidden_region",
    "A forbidden region for the tip targets of operators and CRTK clients: one of sphere, half_space and box.",
    {
        text("name", "unique in the file; what operators read", &teleoperation::ForbiddenRegion::name)
            .required()
            .matching("^[a-z][a-z0-9_-]*$", "a name of lower-case letters, digits, _ and -, starting with a letter"),
        mapping("sphere", kSphereTable, "a sphere").defaultNote("none"),
        mapping("half_space", kHalfSpaceTable, "everything behind a plane").defaultNote("none"),
        mapping("box", kBoxTable, "a box").defaultNote("none"),
    },
    false,
    {{"sphere"}, {"half_space"}, {"box"}}};

const Mapping& guidanceTable() {
  using G = teleoperation::Guidance;
  static const Mapping table{
      "guidance",
      "Guidance path: motion of the operator away from it is attenuated.",
      {
          number("points", kLength, "points of the path, each x, y, z in the robot base frame", &G::points)
              .required()
              .rows(3)
              .list(2, kMostPathPoints),
          number("strength", kNone, "0: no guidance; 1: no motion away from the path", &G::strength)
              .within(0, 1)
              .defaultsTo(0.8),
          positive("radius", kLength, "farther away there is no guidance", &G::radius).defaultsTo(10e-3),
      }};
  return table;
}

const Mapping kCrtkTable{
    "crtk",
    "CRTK command topics, whose clients have no lease.",
    {
        flag("commands", "false: no command topics (saves discovery of 50 readers)", &Crtk::commands),
        text("clients",
             "names of the DDS participants that may command; '*': all. Without this key, no participant may command "
             "and there are no command topics",
             &Crtk::clients)
            .list(1, 50)
            .withoutMotion(),
        text("stamps",
             "how the age of a command is measured: by arrival relative to the fastest sample of its stream "
             "(state_command: by the feedback stamp that it repeats), or, where wall clocks agree, by its stamp",
             {{"wall", false}, {"arrival", true}},
             &Crtk::by_arrival),
        positive("tip_step", kLength, "servo_cp and servo_cr: largest step of a target", &Crtk::tip_step),
        positive("tip_rotation_step",
                 kAngle,
                 "servo_cp and servo_cr: largest rotation of a target",
                 &Crtk::tip_rotation_step),
        positive("translation_step",
                 kLength,
                 "servo_jp and servo_jr: largest step of a translation",
                 &Crtk::translation_step),
        positive("rotation_step", kAngle, "servo_jp and servo_jr: largest step of a rotation", &Crtk::rotation_step),
        positive("acceleration", kAcceleration, "interpolate and move: acceleration of targets", &Crtk::acceleration),
        positive("angular_acceleration",
                 kAngularAcceleration,
                 "interpolate and move: angular acceleration of targets",
                 &Crtk::angular_acceleration),
    }};

teleoperation::Box readBox(const Map& map) {
  const auto box = map.read<teleoperation::Box>();
  if (!(box.minimum.array() < box.maximum.array()).all())
    map.fail("max", "found a value that is not above that of min, expected max above min in x, y and z");
  return box;
}

teleoperation::ForbiddenRegion readRegion(const Map& map) {
  auto region = map.read<teleoperation::ForbiddenRegion>();
  if (map.has("sphere")) {
    region.shape = map.map("sphere").read<teleoperation::Sphere>();
  } else if (map.has("half_space")) {
    const Map half = map.map("half_space");
    auto shape = half.read<teleoperation::HalfSpace>();
    if (!(shape.normal.norm() > 0.0))
      half.fail("normal", "found a vector of length 0, expected a direction, e.g. [0, 0, 1]");
    shape.normal.normalize();
    region.shape = shape;
  } else {
    region.shape = readBox(map.map("box"));
  }
  return region;
}

void checkGuidance(const Map& map, const teleoperation::Guidance& guidance) {
  for (std::size_t i = 0; i + 1 < guidance.points.size(); ++i) {
    if (!((guidance.points[i + 1] - guidance.points[i]).norm() > 0.0))
      map.fail("points", "found the same point twice in a row, expected different ones", static_cast<int>(i + 1));
  }
}

}  // namespace

const Mapping& teleoperationTable() {
  using O = teleoperation::Options;
  using teleoperation::GuardOptions;
  using teleoperation::OneEuroOptions;
  using teleoperation::TipOrientation;
  using R = teleoperation::RotationOptions;
  constexpr auto kOptions = &Teleoperation::options;
  static const Mapping table{
      "teleoperation",
      "How operators' devices and CRTK clients move tips (docs/teleoperation.md).",
      {
          number("scale", kNone, "scale of the device's motion, unless the client requests another one", kOptions,
                 &O::scale)
              .within(teleoperation::kMinScale, teleoperation::kMaxScale),
          positive("scale_rate", kGain, "largest rate at which the scale changes", kOptions, &O::scale_rate),
          notNegative("deadband_speed", kSpeed, "dead band of velocity devices", kOptions, &O::deadband_speed),
          notNegative("deadband_distance", kLength, "dead band of position devices", kOptions, &O::deadband_distance),
          positive("filter_min_cutoff", kFrequency, "One-Euro filter: cutoff at standstill", kOptions, &O::filter,
                   &OneEuroOptions::min_cutoff),
          notNegative("filter_beta", kCurvature, "One-Euro filter: how the cutoff grows with speed, Hz per speed",
                      kOptions, &O::filter, &OneEuroOptions::beta),
          positive("filter_derivative_cutoff", kFrequency, "One-Euro filter: cutoff of the speed", kOptions, &O::filter,
                   &OneEuroOptions::derivative_cutoff),
          positive("max_speed", kSpeed, "largest speed of targets", kOptions, &O::guard, &GuardOptions::max_speed),
          positive("leash", kLength, "largest distance between target and tip (leash)", kOptions, &O::guard,
                   &GuardOptions::leash),
          positive("response", kTime, "time constant with which a tip follows its target; at least two control periods",
                   kOptions, &O::guard, &GuardOptions::response),
          text(
              "orientation",
              "what of a tip's orientation operators and CRTK clients command, behind all positions: nothing, the "
              "direction of its z axis (2 degrees of freedom), or all of it (3)",
              {{"ignored", TipOrientation::kIgnored}, {"axis", TipOrientation::kAxis}, {"full", TipOrientation::kFull}},
              kOptions, &O::rotation, &R::followed),
          positive("rotation_scale", kNone, "scale of the device's rotations", kOptions, &O::rotation, &R::scale)
              .within(teleoperation::kMinScale, teleoperation::kMaxScale),
          notNegative("deadband_angular_speed", kAngularSpeed, "dead band of the rotations of velocity devices",
                      kOptions, &O::rotation, &R::deadband_speed),
          notNegative("deadband_angle", kAngle, "dead band of the orientations of position devices", kOptions,
                      &O::rotation, &R::deadband_angle),
          notNegative("filter_rotation_beta", kNone, "filter_beta of orientations, Hz per rad/s", kOptions,
                      &O::rotation, &R::filter_beta),
          positive("max_angular_speed", kAngularSpeed, "largest angular speed of targets", kOptions, &O::rotation,
                   &R::max_speed),
          positive("leash_angle", kAngle, "largest angle between the orientations of target and tip", kOptions,
                   &O::rotation, &R::leash),
          mapping("workspace", kBoxTable, "box that targets of tips stay in").defaultNote("unlimited"),
          mapping("forbidden", kRegionTable, "regions that targets of tips do not enter")
              .list(0, kMostRegions)
              .defaultNote("none"),
          positive("margin", kLength, "distance that targets keep from forbidden regions", kOptions, &O::guard,
                   &GuardOptions::margin),
          mapping("guidance", guidanceTable(), "guidance path", kOptions, &O::guard, &GuardOptions::guidance)
              .defaultNote("none"),
          mapping("crtk", kCrtkTable, "CRTK commands", &Teleoperation::crtk).defaultNote("all defaults"),
      }};
  return table;
}

Teleoperation readTeleoperation(const Map& map) {
  auto all = map.read<Teleoperation>();
  teleoperation::GuardOptions& guard = all.options.guard;
  map.together(
      [&] {
        if (map.has("workspace"))
          guard.workspace = readBox(map.map("workspace"));
      },
      [&] {
        map.eachDistinct("forbidden", "name", [&](const Map& entry) { guard.forbidden.push_back(readRegion(entry)); });
      },
      [&] {
        if (guard.guidance)
          checkGuidance(map.map("guidance"), *guard.guidance);
      });
  return all;
}

}  // namespace tandem::config
