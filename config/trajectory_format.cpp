// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "config/arm_names.h"
#include "config/config.h"
#include "config/detail/exact.h"

namespace tandem::config {
namespace {

void put(YAML::Emitter& out, const std::string& key, double value) {
  out << YAML::Key << key << YAML::Value << exact(value);
}

void put(YAML::Emitter& out, const Eigen::Vector3d& vector) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const double value : vector)
    out << exact(value);
  out << YAML::EndSeq;
}

void put(YAML::Emitter& out, const std::string& key, const Eigen::Vector3d& vector) {
  out << YAML::Key << key << YAML::Value;
  put(out, vector);
}

struct ShapeWriter {
  YAML::Emitter& out;

  void operator()(const planning::Rectangle& shape) const {
    open("rectangle");
    put(out, "first_m", shape.first);
    put(out, "second_m", shape.second);
  }
  void operator()(const planning::Lissajous& shape) const {
    open("lissajous");
    put(out, "amplitude_m", shape.amplitude);
    put(out, "cycles", shape.cycles);
    put(out, "phase_rad", shape.phase);
  }
  void operator()(const planning::Circle& shape) const {
    open("circle");
    put(out, "center_offset_m", shape.center_offset);
    put(out, "normal", shape.normal);
    put(out, "turns", shape.turns);
  }
  void operator()(const planning::Line& shape) const {
    open("line");
    put(out, "displacement_m", shape.displacement);
  }
  void operator()(const planning::Waypoints& shape) const {
    open("waypoints");
    out << YAML::Key << "absolute" << YAML::Value << shape.absolute << YAML::Key << "points_m" << YAML::Value
        << YAML::BeginSeq;
    for (const Eigen::Vector3d& point : shape.points)
      put(out, point);
    out << YAML::EndSeq;
  }
  void operator()(const planning::Insertion& shape) const {
    open("insertion");
    out << YAML::Key << "stages" << YAML::Value << YAML::BeginSeq;
    for (const planning::InsertionStage& stage : shape.stages) {
      out << YAML::Flow << YAML::BeginMap << YAML::Key << "tubes" << YAML::Value << stage.tubes;
      put(out, "length_m", stage.length);
      out << YAML::EndMap;
    }
    out << YAML::EndSeq;
  }
  void open(const char* name) const { out << YAML::Key << name << YAML::Value << YAML::BeginMap; }
};

const char* headingName(planning::Heading heading) {
  switch (heading) {
    case planning::Heading::kTangent:
      return "tangent";
    case planning::Heading::kWaypoints:
      return "waypoints";
    default:
      return "start";
  }
}

void putShape(YAML::Emitter& out, const char* key, const planning::Shape& shape) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap;
  std::visit(ShapeWriter{out}, shape);
  out << YAML::EndMap << YAML::EndMap;
}

const char* toleranceKey(kinematics::TaskUnit unit) {
  switch (unit) {
    case kinematics::TaskUnit::kRadian:
      return "tolerance_rad";
    case kinematics::TaskUnit::kNone:
      return "tolerance";
    default:
      return "tolerance_m";
  }
}

void putFurther(YAML::Emitter& out, const planning::FurtherTask& task) {
  const std::string arm = nameOrLetter(task.arm_name, task.arm);
  const kinematics::TaskKindEntry& kind = *kinematics::findTaskKind(task.kind);
  out << YAML::BeginMap << YAML::Key << (task.follows_leader ? "follow_the_leader" : std::string(kind.name))
      << YAML::Value << YAML::BeginMap;
  if (task.relative())
    out << YAML::Key << "arms" << YAML::Value << YAML::Flow
        << std::vector{arm, nameOrLetter(task.other_arm_name, task.other_arm)};
  else
    out << YAML::Key << "arm" << YAML::Value << arm;
  if (kind.soft())
    put(out, kind.unit == kinematics::TaskUnit::kMetre ? "distance_m" : "above", task.target.x());
  else if (kind.part == kinematics::TaskPart::kPosition && !task.follows_leader)
    put(out, kind.point == kinematics::TaskPoint::kShaft ? "point_m" : "target_m", task.target);
  else if (!task.follows_leader)
    out << YAML::Key << "desired" << YAML::Value << headingName(task.heading);
  if (!task.waypoints.empty()) {
    out << YAML::Key << "waypoints" << YAML::Value << YAML::BeginSeq;
    for (const planning::HeadingWaypoint& waypoint : task.waypoints) {
      out << YAML::BeginMap;
      put(out, "at", waypoint.at);
      put(out, "rotation_rad", waypoint.rotation);
      out << YAML::EndMap;
    }
    out << YAML::EndSeq;
  }
  if (std::isfinite(task.tolerance))
    put(out, toleranceKey(kind.unit), task.tolerance);
  out << YAML::EndMap << YAML::EndMap;
}

/// In the order of their priorities.
void putTasks(YAML::Emitter& out, const planning::TrajectorySpec& spec) {
  const std::string arm = nameOrLetter(spec.arm_name, spec.arm);
  std::size_t next = 0;
  int place = 0;
  const auto put_further_here = [&] {
    for (; next < spec.further.size() && spec.further[next].priority <= place; ++next, ++place)
      putFurther(out, spec.further[next]);
  };
  put_further_here();
  if (spec.hasRelative()) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "relative" << YAML::Value << YAML::Flow
        << std::vector{arm, nameOrLetter(spec.other_arm_name, spec.other_arm)} << YAML::EndMap;
    ++place;
    put_further_here();
  }
  if (spec.tip_task) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "tip" << YAML::Value << arm << YAML::EndMap;
    ++place;
  }
  put_further_here();
}

}  // namespace

std::string formatTrajectory(const planning::TrajectorySpec& spec) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "tandem" << YAML::Value << "trajectory/1";
  // Quoted: a name may look like a number.
  out << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted << spec.name;
  out << YAML::Key << "tasks" << YAML::Value << YAML::BeginSeq;
  putTasks(out, spec);
  out << YAML::EndSeq;
  putShape(out, "shape", spec.shape);
  if (!spec.relative.empty())
    putShape(out, "relative", spec.relative.front());
  out << YAML::Key << "points" << YAML::Value << spec.point_count;
  out << YAML::Key << "following" << YAML::Value
      << (spec.following == planning::Following::kTimed ? "timed" : "point_by_point");
  put(out, "tolerance_m", spec.tolerance);
  out << YAML::Key << "max_iterations" << YAML::Value << spec.max_iterations;
  put(out, "point_duration_s", spec.point_duration);
  put(out, "speed_m_per_s", spec.speed);
  put(out, "acceleration_m_per_s2", spec.acceleration);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace tandem::config
