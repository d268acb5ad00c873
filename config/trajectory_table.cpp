// SPDX-License-Identifier: Apache-2.0
#include "config/file_tables.h"
#include "planning/trajectory.h"

namespace tandem::config {
namespace {

using enum Quantity;
constexpr int kMostPoints = 100000;

const Mapping& rectangleTable() {
  static const Mapping table{"rectangle",
                             "Closed rectangle from the start: along first, then second, and back.",
                             {
                                 number("first", kLength, "first leg [x, y, z]").required().vector3(),
                                 number("second", kLength, "second leg [x, y, z]").required().vector3(),
                             }};
  return table;
}

const Mapping& lissajousTable() {
  static const Mapping table{
      "lissajous",
      "x_i = amplitude_i sin(2 pi cycles_i t + phase_i) - amplitude_i sin(phase_i), t from 0 to 1.",
      {
          number("amplitude", kLength, "per axis [x, y, z]").required().vector3(),
          number("cycles", kNone, "per axis").required().vector3(),
          number("phase", kAngle, "per axis").vector3().defaultsTo(0.0),
      }};
  return table;
}

const Mapping& circleTable() {
  static const Mapping table{
      "circle",
      "Circle that starts at the start and runs about start + center_offset.",
      {
          number("center_offset", kLength, "from the start to the centre; its length is the radius")
              .required()
              .vector3(),
          number("normal", kNone, "of the circle's plane, perpendicular to center_offset")
              .vector3()
              .defaultNote("[0, 0, 1]"),
          number("turns", kNone, "negative runs backwards; not 0").defaultsTo(planning::Circle{}.turns),
      }};
  return table;
}

const Mapping& lineTable() {
  static const Mapping table{
      "line", "Straight line.", {number("displacement", kLength, "from the start to the end").required().vector3()}};
  return table;
}

const Mapping& waypointsTable() {
  static const Mapping table{
      "waypoints",
      "Polyline through given points.",
      {
          number("points", kLength, "[[x, y, z], ...]").required().list(1, kMostPoints).rows(3),
          flag("absolute", "points in the robot base frame instead of offsets from the start").defaultsTo(0.0),
      }};
  return table;
}

const Mapping& csvTable() {
  static const Mapping table{
      "csv",
      "Polyline through the points of a file: lines `x,y,z` in m, no header.",
      {
          text("file", "path, relative to the folder of this file").required(),
          flag("absolute", "points in the robot base frame instead of offsets from the start").defaultsTo(0.0),
      }};
  return table;
}

const Mapping& shapeTable() {
  static const Mapping table{"shape",
                             "Exactly one of these.",
                             {
                                 mapping("rectangle", rectangleTable(), "closed rectangle"),
                                 mapping("lissajous", lissajousTable(), "sines per axis"),
                                 mapping("circle", circleTable(), "circle"),
                                 mapping("line", lineTable(), "straight line"),
                                 mapping("waypoints", waypointsTable(), "polyline"),
                                 mapping("csv", csvTable(), "polyline from a file"),
                             },
                             true};
  return table;
}

Field armField(const std::string& name, const std::string& description, const std::string& fallback) {
  return text(name, description + ", by letter or by index from 0, in the order of the robot file")
      .oneOf({"a", "b", "c", "d", "e", "f", "g", "h", "0", "1", "2", "3", "4", "5", "6", "7"})
      .orInteger()
      .defaultsTo(fallback);
}

}  // namespace

std::vector<Field> trajectoryFields() {
  const planning::TrajectorySpec defaults;
  return {
      text("name", "name of the trajectory").required(),
      armField("arm", "the arm whose tip follows the shape", "a"),
      armField("other_arm", "its partner in the relative position", "b"),
      mapping("shape", shapeTable(), "where the tip goes").required(),
      integer("points", "points after the start, evenly spaced by arc length")
          .within(1, kMostPoints)
          .defaultsTo(defaults.point_count),
      mapping("relative", shapeTable(), "the relative position: held, or moved along a shape in step with the tip")
          .oneOf({"hold"})
          .defaultsTo("hold"),
      text("following", "next point when within tolerance, or along the path by time")
          .oneOf({"point_by_point", "timed"})
          .defaultsTo("point_by_point"),
      number("tolerance", kLength, "a point is reached when both errors are below it")
          .above(0)
          .defaultsTo(defaults.tolerance),
      integer("max_iterations", "most control steps a point").within(1, 1000000).defaultsTo(defaults.max_iterations),
      number("point_duration", kTime, "time a point is meant to take; feed-forward = spacing / point_duration")
          .above(0)
          .defaultsTo(defaults.point_duration),
      number("speed", kSpeed, "along the path, timed following").above(0).defaultsTo(defaults.speed),
      number("acceleration", kAcceleration, "along the path, timed following")
          .above(0)
          .defaultsTo(defaults.acceleration),
  };
}

const Mapping& trajectoryTable() {
  static const Mapping table = [] {
    Mapping trajectory{
        "trajectory",
        "A trajectory of one tip, with the relative position of two tips held or moved.",
        {text("tandem", "kind and version of the file; the first key").required().oneOf({"trajectory/1"})}};
    for (const Field& field : trajectoryFields())
      trajectory.fields.push_back(field);
    return trajectory;
  }();
  return table;
}

}  // namespace tandem::config
