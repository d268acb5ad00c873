// SPDX-License-Identifier: Apache-2.0
#include "config/path.h"

#include <yaml-cpp/yaml.h>

#include "config/exact.h"
#include "config/file_tables.h"
#include "config/loaders.h"

namespace tandem::config {
namespace {

using enum Quantity;

planning::ObjectPath readPath(const Map& map) {
  planning::ObjectPath path;
  map.text("tandem");
  path.name = map.text("name");
  path.shape = planning::pathShape(map.text("shape"));
  for (const std::string& direction : map.texts("along"))
    path.directions.push_back(planning::directionOf(direction));
  const std::size_t wanted = path.shape == planning::PathShape::kLine ? 1 : 2;
  if (path.directions.size() != wanted) {
    map.fail("along", "found " + std::to_string(path.directions.size()) + " of them, expected " +
                          (wanted == 1 ? "one, for a line" : "two, for a " + nameOf(path.shape)));
  }
  path.size = map.number("size");
  path.duration = map.number("duration");
  path.held = planning::holdOf(map.text("hold"));
  return path;
}

}  // namespace

const Mapping& pathTable() {
  static const Mapping table = [] {
    const planning::ObjectPath defaults;
    return Mapping{
        "path",
        "A path of what catheters move: an object that they hold, or a tip. It begins and ends at rest where it is.",
        {
            text("tandem", "kind and version of the file; the first key").required().oneOf({"path/1"}),
            text("name", "name of the path").required(),
            text("shape", "out and back, a circle, or an eight").required().oneOf({"line", "circle", "lissajous"}),
            text("along", "directions of the robot base frame: one of a line, else two; rx, ry, rz are turns")
                .required()
                .oneOf({"x", "y", "z", "rx", "ry", "rz"})
                .list(1, 2)
                .unique(),
            number("size", kLength,
                   "how far a line goes, radius of a circle, amplitude of an eight; a turn goes as far at the size of "
                   "what is moved")
                .within(1e-6, 1.0)
                .defaultsTo(defaults.size),
            number("duration", kTime, "from rest to rest").within(0.1, 3600.0).defaultsTo(defaults.duration),
            text("hold", "what is held beside the directions: nothing, the place, or place and orientation")
                .oneOf({"none", "places", "all"})
                .defaultsTo(nameOf(defaults.held)),
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
    out << YAML::DoubleQuoted << planning::directionName(direction);  // y alone is a truth value to some readers
  out << YAML::EndSeq;
  out << YAML::Key << "size_m" << YAML::Value << exact(path.size);
  out << YAML::Key << "duration_s" << YAML::Value << exact(path.duration);
  out << YAML::Key << "hold" << YAML::Value << nameOf(path.held) << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string kindOfText(const std::string& yaml, const std::string& origin) { return Document(origin, yaml).kind(); }

}  // namespace tandem::config
