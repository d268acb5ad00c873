// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "config/detail/bind.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "planning/trajectory.h"

namespace tandem::config {
namespace {

using enum Quantity;
using Spec = planning::TrajectorySpec;
constexpr int kMostPoints = 100000;
constexpr double kShort = 1e-6, kLong = 0.3;  // m, of the parts of a path that fit into a body

const Mapping kRectangleTable{"rectangle",
                              "Closed rectangle from the start: along first, then second, and back.",
                              {
                                  number("first", kLength, "first leg [x, y, z]", &planning::Rectangle::first)
                                      .required()
                                      .vector3()
                                      .usually(kShort, kLong),
                                  number("second", kLength, "second leg [x, y, z]", &planning::Rectangle::second)
                                      .required()
                                      .vector3()
                                      .usually(kShort, kLong),
                              }};

const Mapping kLissajousTable{
    "lissajous",
    "x_i = amplitude_i sin(2 pi cycles_i t + phase_i) - amplitude_i sin(phase_i), t from 0 to 1.",
    {
        number("amplitude", kLength, "amplitude per axis [x, y, z]", &planning::Lissajous::amplitude)
            .required()
            .vector3()
            .usually(kShort, kLong),
        number("cycles", kNone, "number of cycles per axis", &planning::Lissajous::cycles).required().vector3(),
        number("phase", kAngle, "phase per axis", &planning::Lissajous::phase).vector3(),
    }};

const Mapping kCircleTable{
    "circle",
    "Circle through the start position about start + center_offset.",
    {
        number("center_offset",
               kLength,
               "vector from the start to the centre; its length is the radius",
               &planning::Circle::center_offset)
            .required()
            .vector3()
            .usually(kShort, kLong),
        number("normal",
               kNone,
               "normal of the circle's plane, perpendicular to center_offset",
               &planning::Circle::normal)
            .vector3()
            .defaultNote("[0, 0, 1]"),
        number("turns", kNone, "number of turns; negative: in the opposite direction; not 0", &planning::Circle::turns),
    }};

const Mapping kLineTable{
    "line",
    "Straight line.",
    {number("displacement", kLength, "vector from the start to the end", &planning::Line::displacement)
         .required()
         .vector3()
         .usually(kShort, kLong)}};

const Mapping kWaypointsTable{"waypoints",
                              "Polyline through given points.",
                              {
                                  number("points", kLength, "[[x, y, z], ...]", &planning::Waypoints::points)
                                      .required()
                                      .list(1, kMostPoints)
                                      .rows(3),
                                  flag("absolute",
                                       "points in the robot base frame instead of offsets from the start",
                                       &planning::Waypoints::absolute),
                              }};

const Mapping kCsvTable{
    "csv",
    "Polyline through the points of a file: lines `x,y,z` in m, or with a header that names units (`x_mm,y_mm,z_mm`).",
    {
        text("file", "path, relative to the folder of this file").required(),
        flag("absolute",
             "points in the robot base frame instead of offsets from the start",
             &planning::Waypoints::absolute),
    }};

const Mapping kInsertionStageTable{
    "insertion_stage",
    "The innermost tubes advance together.",
    {
        integer("tubes", "number of tubes that advance; 1: the innermost alone", &planning::InsertionStage::tubes)
            .required()
            .within(1, kinematics::kMaxTubes),
        positive("length", kLength, "by which they advance", &planning::InsertionStage::length)
            .required()
            .usually(kShort, kLong),
    }};

const Mapping kInsertionTable{
    "insertion",
    "The arm's own path: tubes advance without turning, one stage after the other. The tip goes where they take it.",
    {mapping("stages", kInsertionStageTable, "in their order; the outer tubes first", &planning::Insertion::stages)
         .required()
         .list(1, 100)}};

const Mapping kShapeTable{"shape",
                          "Exactly one of these.",
                          {
                              mapping("rectangle", kRectangleTable, "closed rectangle"),
                              mapping("lissajous", kLissajousTable, "sines per axis"),
                              mapping("circle", kCircleTable, "circle"),
                              mapping("line", kLineTable, "straight line"),
                              mapping("waypoints", kWaypointsTable, "polyline"),
                              mapping("csv", kCsvTable, "polyline from a file"),
                              mapping("insertion", kInsertionTable, "the arm's own path; not of a relative position"),
                          },
                          true};

template <class Owner, class Value>
Field armField(const std::string& key, const std::string& description, Value Owner::*arm) {
  return text(key, description + ", by its name in the robot file, or by letter or index from 0 in that file's order",
              arm)
      .matching("^([a-z][a-z0-9_]*|[0-" + std::to_string(safety::kMaxArms - 1) + "])$",
                "the name of an arm, or its letter or index")
      .orInteger();
}

using Further = TrajectoryFurther;

const Mapping kHeadingWaypointTable{
    "heading_waypoint",
    "Rotation from the orientation at the start.",
    {
        number("at", kNone, "fraction of the path, by points", &planning::HeadingWaypoint::at).required().within(0, 1),
        number(
            "rotation",
            kAngle,
            "rotation vector [x, y, z] from the start, in the robot base frame; of a relative orientation in the frame "
            "of the second tip",
            &planning::HeadingWaypoint::rotation)
            .required()
            .vector3()
            .within(-std::numbers::pi, std::numbers::pi),
    }};

Field waypointsField() {
  return mapping("waypoints", kHeadingWaypointTable,
                 "of `desired: waypoints`, in ascending order, with slerp between them", &Further::waypoints)
      .list(1, 1000)
      .defaultNote("none");
}

Field toleranceField() {
  return number("tolerance", kAngle, "a point is reached only when the angular error is below it too",
                &Further::tolerance)
      .above(0)
      .orUnlimited();
}

Field distanceToleranceField() {
  return number("tolerance", kLength,
                "a point of the path is reached only when the error of this task is below it too; for poses one radian "
                "counts as 0.05 m",
                &Further::tolerance)
      .above(0)
      .orUnlimited();
}

/// Table of a kind of one tip.
Mapping headingTable(const char* name, const char* description, const Field& tolerance) {
  return {name,
          description,
          {
              armField("arm", "whose tip", &Further::arm).required(),
              text("desired",
                   "orientation. start: kept as at the start; tangent: the tip's z axis along the path; waypoints: by "
                   "rotations from the start",
                   {{"start", planning::Heading::kStart},
                    {"tangent", planning::Heading::kTangent},
                    {"waypoints", planning::Heading::kWaypoints}},
                   &Further::desired),
              waypointsField(),
              tolerance,
          }};
}

/// Table of a kind of two tips.
Mapping relativeHeadingTable(const char* name, const char* description, const Field& tolerance) {
  return {
      name,
      description,
      {
          armField("arms", "the two tips", &Further::arms).list(2, 2).unique().required(),
          text("desired", "orientation. start: kept as at the start; waypoints: by rotations from the start",
               {{"start", planning::Heading::kStart}, {"waypoints", planning::Heading::kWaypoints}}, &Further::desired),
          waypointsField(),
          tolerance,
      }};
}

const Mapping kHeadingTable = headingTable("heading", "Desired axis or orientation of one tip.", toleranceField());
const Mapping kPoseTable = headingTable(
    "pose",
    "Desired pose of one tip. The position of the tip that follows the shape is that of the shape; another "
    "one is kept as at the start.",
    distanceToleranceField());
const Mapping kRelativeHeadingTable =
    relativeHeadingTable("relative_heading",
                         "Desired orientation of the first tip in the frame of the second one.",
                         toleranceField());
const Mapping kRelativePoseTable = relativeHeadingTable(
    "relative_pose",
    "Desired pose of the first tip in the frame of the second one. The position is kept as at the start.",
    distanceToleranceField());

const Mapping kLookAtTable{
    "look_at",
    "A tip whose z axis points at a target.",
    {
        armField("arm", "whose tip", &Further::arm).required(),
        number("target", kLength, "[x, y, z] in the robot base frame", &Further::target).required().vector3(),
        toleranceField(),
    }};

const Mapping kRemoteCentreTable{
    "remote_centre",
    "An arm whose shaft passes a point.",
    {
        armField("arm", "whose shaft", &Further::arm).required(),
        number("point", kLength, "[x, y, z] in the robot base frame", &Further::target).required().vector3(),
        distanceToleranceField(),
    }};

const Mapping kFollowTheLeaderTable{
    "follow_the_leader",
    "An arm whose shaft stays on its path: where it was at the start, and where its tip has gone since.",
    {
        armField("arm", "the arm that follows the shape", &Further::arm).required(),
        distanceToleranceField(),
    }};

const Mapping kJointLimitsTable{
    "joint_limits",
    "An arm whose joints keep away from their limits.",
    {
        armField("arm", "whose joints", &Further::arm).required(),
        positive("distance",
                 kLength,
                 "d: limits nearer than this count; of rotations one radian counts as 0.05 m",
                 &Further::distance)
            .required()
            .usually(1e-4, 0.02),
        number("tolerance",
               kLength,
               "a point of the path is reached only when C, at most d / 2 for one limit, is below it too",
               &Further::tolerance)
            .above(0)
            .orUnlimited(),
    }};

const Mapping kElasticStabilityTable{
    "elastic_stability",
    "An arm that keeps its elastic stability; compliant model.",
    {
        armField("arm", "which arm", &Further::arm).required(),
        number("above",
               kNone,
               "d: a stability below this counts; 0 is a snap, 1 no elastic interaction",
               &Further::distance)
            .required()
            .above(0)
            .within(0, 1),
        number("tolerance",
               kNone,
               "a point of the path is reached only when C, d / 2 at a snap, is below it too",
               &Further::tolerance)
            .above(0)
            .orUnlimited(),
    }};

const Mapping kTaskTable{
    "task",
    "Exactly one of these.",
    {
        armField("tip", "the tip that follows the shape", &TrajectoryTask::tip),
        armField("relative",
                 "the position of the first tip relative to the second, see the key `relative`",
                 &TrajectoryTask::relative)
            .list(2, 2)
            .unique(),
        mapping("axis", kHeadingTable, "the z axis of a tip: two degrees of freedom", &TrajectoryTask::axis),
        mapping("orientation",
                kHeadingTable,
                "the orientation of a tip: three degrees of freedom",
                &TrajectoryTask::orientation),
        mapping("relative_orientation",
                kRelativeHeadingTable,
                "the orientation of one tip relative to another: three degrees of freedom",
                &TrajectoryTask::relative_orientation),
        mapping("look_at",
                kLookAtTable,
                "the z axis of a tip points at a target: two degrees of freedom",
                &TrajectoryTask::look_at),
        mapping("remote_centre",
                kRemoteCentreTable,
                "the shaft of an arm passes a point: two degrees of freedom",
                &TrajectoryTask::remote_centre),
        mapping("follow_the_leader",
                kFollowTheLeaderTable,
                "the shaft of the arm that follows the shape stays on its path: two degrees of freedom",
                &TrajectoryTask::follow_the_leader),
        mapping("pose",
                kPoseTable,
                "position and orientation of a tip as one task: six degrees of freedom; takes the place of `tip`",
                &TrajectoryTask::pose),
        mapping("relative_pose",
                kRelativePoseTable,
                "position and orientation of one tip relative to another as one task: six degrees of freedom",
                &TrajectoryTask::relative_pose),
        mapping("joint_limits",
                kJointLimitsTable,
                "soft: the joints of an arm keep away from their limits; one degree of freedom where one is near",
                &TrajectoryTask::joint_limits),
        mapping("elastic_stability",
                kElasticStabilityTable,
                "soft: an arm keeps its elastic stability; one degree of freedom where it is low",
                &TrajectoryTask::elastic_stability),
    },
    true};

}  // namespace

std::vector<Field> trajectoryFields() {
  using planning::Following;
  return {
      text("name", "name of the trajectory", &Spec::name).required(),
      mapping("tasks", kTaskTable,
              "what is tracked, highest priority first: `- tip: a`, before it where wanted `- relative: [a, b]`, and "
              "further tasks at any place")
          .list(1, planning::kMaxTasks)
          .defaultNote("the relative position of arm and other_arm, then the tip of arm"),
      armField("arm", "short form of tasks: the arm whose tip follows the shape", &Spec::arm_name).defaultsTo("a"),
      armField("other_arm", "short form of tasks: its partner in the relative position", &Spec::other_arm_name)
          .defaultsTo("b"),
      mapping("shape", kShapeTable, "shape of the path of the tip").required(),
      integer("points", "points after the start, evenly spaced by arc length", &Spec::point_count)
          .within(1, kMostPoints),
      mapping("relative", kShapeTable, "the relative position: held, or moved along a shape in step with the tip")
          .oneOf({"hold"})
          .defaultsTo("hold"),
      text("following", "point_by_point: next point when within tolerance; timed: along the path by time",
           {{"point_by_point", Following::kPointByPoint}, {"timed", Following::kTimed}}, &Spec::following),
      positive("tolerance", kLength, "a point is reached when both errors are below it", &Spec::tolerance)
          .usually(1e-6, 0.02),
      integer("max_iterations", "largest number of control steps per point", &Spec::max_iterations).within(1, 1000000),
      positive("point_duration", kTime, "nominal time per point; feed-forward = spacing / point_duration",
               &Spec::point_duration),
      positive("speed", kSpeed, "speed along the path, with `following: timed`", &Spec::speed).usually(1e-6, 0.2),
      positive("acceleration", kAcceleration, "acceleration along the path, with `following: timed`",
               &Spec::acceleration)
          .usually(1e-6, 2.0),
  };
}

const Mapping& trajectoryTable() {
  static const Mapping table = [] {
    Mapping trajectory{"trajectory",
                       "A trajectory of one tip, alone or with the relative position of two tips held or moved.",
                       {kindField("trajectory")}};
    for (const Field& field : trajectoryFields())
      trajectory.fields.push_back(field);
    return trajectory;
  }();
  return table;
}

}  // namespace tandem::config
