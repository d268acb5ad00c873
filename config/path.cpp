// SPDX-License-Identifier: Apache-2.0
#include "config/path.h"

#include <yaml-cpp/yaml.h>

#include "config/detail/bind.h"
#include "config/detail/exact.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

using enum Quantity;

planning::ObjectPath readPath(const Map& map) {
  auto path = map.read<planning::ObjectPath>();
  const std::size_t wanted = path.shape == planning::PathShape::kLine ? 1 : 2;
  if (path.directions.size() != wanted) {
    map.fail("along", "found " + std::to_string(path.directions.size()) + " directions, expected " +
                          (wanted == 1 ? "one for a line" : "two for a " + nameOf(path.shape)));
  }
  return path;
}

}  // namespace

const Mapping& pathTable() {
  static const Mapping table = [] {
    using planning::Kept;
    using planning::PathShape;
    using P = planning::ObjectPath;
    Words<int> directions;
    for (int k = 0; k < 6; ++k)
      directions.emplace_back(planning::directionName(k), k);
    return Mapping{
        "path",
        "Path of the common object (grasped object or target tip), from standstill to standstill.",
        {
            kindField("path"),
            text("name", "name of the path", &P::name).required(),
            text("shape", "line (out and back), circle, or lissajous (figure eight)",
                 named({PathShape::kLine, PathShape::kCircle, PathShape::kLissajous}), &P::shape)
                .required(),
            text("along", "directions in the robot base frame: one for a line, two otherwise; rx, ry, rz are rotations",
                 directions, &P::directions)
                .required()
                .list(1, 2)
                .unique(),
            number("size", kLength,
                   "length of a line, radius of a circle, amplitude of a lissajous; for rotations: arc length at the "
                   "object's size",
                   &P::size)
                .within(1e-6, 1.0),
            number("duration", kTime, "duration of the motion, from standstill to standstill", &P::duration)
                .within(0.1, 3600.0),
            text("hold",
                 "components held constant besides the directions: none, places (position), all (position and "
                 "orientation)",
                 named({Kept::kNone, Kept::kPosition, Kept::kAll}), &P::kept),
        }};
  }();
  return table;
}

planning::ObjectPath parsePath(const std::string& yaml, const std::string& origin) {
  Document document(origin, yaml);
  const planning::ObjectPath path = readPath(document.check(pathTable()));
  document.finish();
  return path;
}

planning::ObjectPath loadPath(const std::filesystem::path& file) { return parsePath(readFile(file), file.string()); }

std::string formatPath(const planning::ObjectPath& path) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "tandem" << YAML::Value << "path/1";
  // Quoted: a name may look like a number.
  out << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted << path.name;
  out << YAML::Key << "shape" << YAML::Value << nameOf(path.shape);
  out << YAML::Key << "along" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const int direction : path.directions)
    out << YAML::DoubleQuoted << planning::directionName(direction);  // some YAML readers take y as a boolean
  out << YAML::EndSeq;
  out << YAML::Key << "size_m" << YAML::Value << exact(path.size);
  out << YAML::Key << "duration_s" << YAML::Value << exact(path.duration);
  out << YAML::Key << "hold" << YAML::Value << nameOf(path.kept) << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string kindOfText(const std::string& yaml, const std::string& origin) { return Document(origin, yaml).kind(); }

}  // namespace tandem::config
