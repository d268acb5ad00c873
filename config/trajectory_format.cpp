// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>

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
  void open(const char* name) const { out << YAML::Key << name << YAML::Value << YAML::BeginMap; }
};

void putShape(YAML::Emitter& out, const char* key, const planning::Shape& shape) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap;
  std::visit(ShapeWriter{out}, shape);
  out << YAML::EndMap << YAML::EndMap;
}

}  // namespace

std::string formatTrajectory(const planning::TrajectorySpec& spec) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "tandem" << YAML::Value << "trajectory/1";
  // Quoted: a name may look like a number.
  out << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted << spec.name;
  out << YAML::Key << "tasks" << YAML::Value << YAML::BeginSeq;
  const std::string arm = nameOrLetter(spec.arm_name, spec.arm),
                    other_arm = nameOrLetter(spec.other_arm_name, spec.other_arm);
  if (spec.hasRelative())
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "relative" << YAML::Value << YAML::Flow
        << std::vector{arm, other_arm} << YAML::EndMap;
  out << YAML::Flow << YAML::BeginMap << YAML::Key << "tip" << YAML::Value << arm << YAML::EndMap << YAML::EndSeq;
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
