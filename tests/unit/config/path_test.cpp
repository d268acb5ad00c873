// SPDX-License-Identifier: Apache-2.0
#include "config/path.h"

#include <random>

#include "support.h"

namespace tandem::config::test {
namespace {

using planning::Kept;
using planning::ObjectPath;
using planning::PathShape;

ObjectPath parsePathText(const std::string& text) { return parsePath(text, "text"); }

TEST(Path, PresetsAreWhatTheyAreCalled) {
  const ObjectPath lift = loadPath(presets() / "paths/lift.yaml");
  EXPECT_EQ(lift.name, "lift");
  EXPECT_EQ(lift.shape, PathShape::kLine);
  EXPECT_EQ(lift.directions, std::vector<int>{2});
  EXPECT_DOUBLE_EQ(lift.size, 3e-3);
  EXPECT_DOUBLE_EQ(lift.duration, 10.0);
  EXPECT_EQ(lift.kept, Kept::kNone);
  const ObjectPath eight = loadPath(presets() / "paths/tip-eight.yaml");
  EXPECT_EQ(eight.shape, PathShape::kLissajous);
  EXPECT_EQ(eight.directions, (std::vector<int>{0, 1}));
  EXPECT_EQ(eight.kept, Kept::kPosition);
  EXPECT_EQ(validate(presets() / "paths/tip-eight.yaml").text,
            "path tip-eight: lissajous along x, y of 5 mm in 10 s, held: places");
}

TEST(Path, EveryKeyReachesItsFieldAndDefaultsAreThoseOfTheStruct) {
  const std::string text =
      "tandem: path/1\nname: \"7\"\nshape: circle\nalong: [rz, x]\nsize_m: 0.002\nduration_ms: 2500\nhold: all\n";
  expectEveryKey(text, pathTable());
  const ObjectPath path = parsePathText(text);
  EXPECT_EQ(path.name, "7");
  EXPECT_EQ(path.shape, PathShape::kCircle);
  EXPECT_EQ(path.directions, (std::vector<int>{5, 0}));
  EXPECT_DOUBLE_EQ(path.size, 2e-3);
  EXPECT_DOUBLE_EQ(path.duration, 2.5);
  EXPECT_EQ(path.kept, Kept::kAll);
  const ObjectPath usual = parsePathText("tandem: path/1\nname: t\nshape: line\nalong: [ry]\n"), defaults;
  EXPECT_EQ(usual.size, defaults.size);
  EXPECT_EQ(usual.duration, defaults.duration);
  EXPECT_EQ(usual.kept, defaults.kept);
  EXPECT_EQ(usual.length, defaults.length);
}

TEST(Path, FormattedTextReadsBack) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto below = [&](int n) { return std::uniform_int_distribution<>(0, n - 1)(random); };
  for (int trial = 0; trial < 300; ++trial) {
    ObjectPath path;
    path.shape = static_cast<PathShape>(below(3));
    path.directions = {below(6)};
    if (path.shape != PathShape::kLine)
      path.directions.push_back((path.directions[0] + 1 + below(5)) % 6);
    path.size = std::uniform_real_distribution<>(1e-6, 1.0)(random);
    path.duration = std::uniform_real_distribution<>(0.1, 3600.0)(random);
    path.kept = static_cast<Kept>(below(3));
    path.name = trial % 2 ? "12 \"quoted\": #" : "plain";
    const std::string text = formatPath(path);
    SCOPED_TRACE(text);
    const ObjectPath back = parsePathText(text);
    EXPECT_EQ(back.shape, path.shape);
    EXPECT_EQ(back.directions, path.directions);
    EXPECT_EQ(back.size, path.size);
    EXPECT_EQ(back.duration, path.duration);
    EXPECT_EQ(back.kept, path.kept);
    EXPECT_EQ(back.name, path.name);
    EXPECT_EQ(kindOfText(text, "text"), "path");
    if (HasFailure())
      break;
  }
}

TEST(Path, Refusals) {
  const auto load_file = [](const std::filesystem::path& file) { loadPath(file); };
  const std::string eight = readAll(presets() / "paths/tip-eight.yaml");
  const Refusal refusals[] = {
      {"path/1", "trajectory/1", "trajectory/1", 0, "tandem", "found trajectory/1, expected path/1"},
      {"shape: lissajous", "shape: spiral", "spiral", 0, "shape", "expected one of line, circle, lissajous"},
      {"shape: lissajous", "shape: line", "[x, y]", 0, "along", "found 2 directions, expected one for a line"},
      {"[x, y]", "[x]", "[x]", 0, "along", "found 1 directions, expected two for a lissajous"},
      {"[x, y]", "[x, x]", "x]", 0, "along[1]", "x"},
      {"[x, y]", "[x, w]", "w]", 0, "along[1]", "expected one of x, y, z, rx, ry, rz"},
      {"[x, y]", "[]", "[]", 0, "along", "expected a list of 1 to 2"},
      {"size_mm: 5", "size_mm: 0", "0\nduration", 0, "size_mm", "expected a length from 0.001 to 1000 in mm"},
      {"size_mm: 5", "size: 5", "size: 5", 0, "size", "size_mm"},
      {"duration_s: 10", "duration_s: -1", "-1", 0, "duration_s", "found -1"},
      {"hold: places", "hold: some", "some", 0, "hold", "expected one of none, places, all"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusal(eight, refusal, load_file);
}

}  // namespace
}  // namespace tandem::config::test
