// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>

#include "config/arm_names.h"
#include "config/csv_header.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

/// Larger deviations from a right angle are errors; smaller ones come from rounded decimals and are removed.
constexpr double kPerpendicular = 1e-6;

void expectLength(const Map& map, const std::string& key) {
  if (map.vector3(key).norm() == 0.0)
    map.fail(key, "found [0, 0, 0], expected a vector other than zero");
}

planning::Rectangle readRectangle(const Map& map) {
  expectLength(map, "first");
  expectLength(map, "second");
  return map.read<planning::Rectangle>();
}

planning::Lissajous readLissajous(const Map& map) {
  const auto shape = map.read<planning::Lissajous>();
  if (shape.amplitude.cwiseProduct(shape.cycles).norm() == 0.0) {
    map.fail("amplitude", "found no axis with both amplitude and cycles other than zero, expected at least one");
  }
  return shape;
}

planning::Circle readCircle(const Map& map) {
  auto shape = map.read<planning::Circle>();
  expectLength(map, "center_offset");
  if (map.has("normal"))
    expectLength(map, "normal");
  if (shape.turns == 0.0)
    map.fail("turns", "found 0, expected another number");
  const Eigen::Vector3d normal = shape.normal.normalized(), radius = shape.center_offset.normalized();
  const double cosine = normal.dot(radius);
  if (std::abs(cosine) > kPerpendicular) {
    map.fail("normal", "found an angle of " + formatNumber(std::round(std::acos(cosine) * 1800.0 / M_PI) / 10.0) +
                           " deg to " + map.keyOf("center_offset") + ", expected 90 deg");
  }
  shape.normal = (normal - cosine * radius).normalized();
  return shape;
}

planning::Line readLine(const Map& map) {
  expectLength(map, "displacement");
  return map.read<planning::Line>();
}

planning::Waypoints readCsv(const Map& map, const std::filesystem::path& folder) {
  const std::string file = map.text("file");
  if (folder.empty())
    map.fail("file", "found a file, expected `waypoints`: a trajectory sent as text cannot refer to a file");
  if (!std::filesystem::is_regular_file(folder / file)) {
    map.fail("file", "found no file " + (folder / file).string() + ", expected a path relative to this file's folder");
  }
  auto shape = map.read<planning::Waypoints>();
  shape.points = readPoints(folder / file);
  return shape;
}

planning::Shape readShape(const Map& map, const std::filesystem::path& folder) {
  if (map.has("rectangle"))
    return readRectangle(map.map("rectangle"));
  if (map.has("lissajous"))
    return readLissajous(map.map("lissajous"));
  if (map.has("circle"))
    return readCircle(map.map("circle"));
  if (map.has("line"))
    return readLine(map.map("line"));
  if (map.has("insertion"))
    return map.map("insertion").read<planning::Insertion>();
  if (map.has("waypoints"))
    return map.map("waypoints").read<planning::Waypoints>();
  return readCsv(map.map("csv"), folder);
}

/// Parses one number between commas, with optional blanks around it.
bool parseCell(const std::string& line, std::size_t begin, std::size_t end, double& value) {
  while (begin < end && (line[begin] == ' ' || line[begin] == '\t'))
    ++begin;
  while (end > begin && (line[end - 1] == ' ' || line[end - 1] == '\t'))
    --end;
  const auto [stopped, status] = std::from_chars(line.data() + begin, line.data() + end, value);
  return begin < end && status == std::errc{} && stopped == line.data() + end && std::isfinite(value);
}

Eigen::Vector3d parseRow(const std::string& line, const std::string& file, int number) {
  Eigen::Vector3d point;
  std::size_t begin = 0;
  int column = 0;
  while (begin <= line.size()) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    double value = 0.0;
    if (column >= 3 || !parseCell(line, begin, end, value)) {
      throw Error(file, number, static_cast<int>(begin) + 1, "",
                  "found '" + line.substr(begin, std::min<std::size_t>(end - begin, 40)) + "' in column " +
                      std::to_string(column + 1) + ", expected " +
                      (column >= 3 ? "three columns" : "a finite number in m"));
    }
    point[column++] = value;
    begin = end + 1;
  }
  if (column != 3) {
    throw Error(file, number, 1, "", "found " + std::to_string(column) + " columns, expected three: x,y,z in m");
  }
  return point;
}

/// Column of the first character of a field, from 1.
int columnOf(const std::string& line, std::size_t field) {
  std::size_t begin = 0;
  for (; field > 0; --field)
    begin = line.find(',', begin) + 1;
  return static_cast<int>(begin) + 1;
}

/// A row of a table with a header.
Eigen::Vector3d parseRow(const std::string& line, const CsvLayout& layout, const std::string& file, int number) {
  const std::vector<std::string> fields = csvFields(line);
  if (fields.size() != layout.fields)
    throw Error(file, number, 1, "",
                "found " + std::to_string(fields.size()) + " columns, expected the " + std::to_string(layout.fields) +
                    " of the header");
  Eigen::Vector3d point;
  for (int axis = 0; axis < 3; ++axis) {
    const CsvLayout::Place& place = layout.places[static_cast<std::size_t>(axis)];
    const std::string& field = fields[place.field];
    if (!parseCell(field, 0, field.size(), point[axis]))
      throw Error(file, number, columnOf(line, place.field), "",
                  "found '" + field.substr(0, 40) + "' in column " + std::to_string(place.field + 1) +
                      ", expected a finite number");
    if (place.unit != nullptr)
      point[axis] = place.unit->toSi(point[axis]);
  }
  return point;
}

}  // namespace

std::vector<Eigen::Vector3d> readPoints(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<Eigen::Vector3d> points;
  std::optional<CsvLayout> layout;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    if (number == 1) {
      const auto length = [](const char* name) { return CsvColumn{name, Quantity::kLength}; };
      layout = readCsvHeader(line, {length("x"), length("y"), length("z")}, file.string());
      if (layout)
        continue;
    }
    points.push_back(layout ? parseRow(line, *layout, file.string(), number) : parseRow(line, file.string(), number));
  }
  if (points.empty())
    throw Error(file.string(), 1, 1, "",
                "found no points, expected lines of x,y,z in m, or a header with units (x_mm,y_mm,z_mm)");
  return points;
}

planning::TrajectorySpec readTrajectory(const Map& map, const std::filesystem::path& folder) {
  auto spec = map.read<planning::TrajectorySpec>();
  readTasks(map, spec);
  spec.arm = indexOfLetter(spec.arm_name);
  spec.other_arm = spec.other_arm_name.empty() ? planning::kNoArm : indexOfLetter(spec.other_arm_name);
  if (spec.arm_name == spec.other_arm_name)
    map.fail(map.has("other_arm") ? "other_arm" : "arm", planning::kSameArmTwice);
  spec.shape = readShape(map.map("shape"), folder);
  if (!map.isWord("relative") && map.map("relative").has("insertion"))
    map.map("relative").fail("insertion", "found the own path of an arm, expected a shape of a relative position");
  if (!map.isWord("relative"))
    spec.relative.push_back(readShape(map.map("relative"), folder));
  return spec;
}

planning::TrajectorySpec parseTrajectory(const std::string& yaml,
                                         const std::string& origin,
                                         const std::filesystem::path& folder) {
  Document document(origin, yaml);
  const Map map = document.check(trajectoryTable());
  planning::TrajectorySpec spec = readTrajectory(map, folder);
  document.finish();
  return spec;
}

planning::TrajectorySpec loadTrajectory(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  return parseTrajectory(readFile(file), file.string(), folder);
}

}  // namespace tandem::config
