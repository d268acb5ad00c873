// SPDX-License-Identifier: Apache-2.0
#include "config/path.h"

#include <yaml-cpp/yaml.h>

#include "config/bind.h"
#include "config/exact.h"
#include "config/file_tables.h"
#include "config/loaders.h"

namespace tandem::config {
namespace {

using enum Quantity;

planning::ObjectPath readPath(const Map& map) {
  auto path = map.read<planning::ObjectPath>();
  const std::size_t wanted = path.shape == planning::PathShape::kLine ? 1 : 2;
  if (path.directions.size() != wanted) {
    map.fail("along", "found " + std::to_string(path.directions.size()) + " of them, expected " +
                          (wanted == 1 ? "one, for a line" : "two, for a " + nameOf(path.shape)));
  }
  return path;
}

}  // namespace

const Mapping& pathTable() {
  static const Mapping table = [] {
    using planning::Hold;
    using planning::PathShape;
    using P = planning::ObjectPath;
    Words<int> directions;
    for (int k = 0; k < 6; ++k)
      directions.emplace_back(planning::directionName(k), k);
    return Mapping{
        "path",
        "A path of what catheters move: an object that they hold, or a tip. It begins and ends at rest where it is.",
        {
            kindField("path"),
            text("name", "name of the path", &P::name).required(),
            text("shape", "out and back, a circle, or an eight",
                 named({PathShape::kLine, PathShape::kCircle, PathShape::kLissajous}), &P::shape)
                .required(),
            text("along", "directions of the robot base frame: one of a line, else two; rx, ry, rz are turns",
                 directions, &P::directions)
                .required()
                .list(1, 2)
                .unique(),
            number("size", kLength,
                   "how far a line goes, radius of a circle, amplitude of an eight; a turn goes as far at the size of "
                   "what is moved",
                   &P::size)
                .within(1e-6, 1.0),
            number("duration", kTime, "from rest to rest", &P::duration).within(0.1, 3600.0),
            text("hold", "what is held beside the directions: nothing, the place, or place and orientation",
                 named({Hold::kNone, Hold::kPlaces, Hold::kAll}), &P::held),
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
