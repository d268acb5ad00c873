// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <random>

#include "config/arm_names.h"
#include "support.h"

namespace tandem::config::test {
namespace {

using planning::TrajectorySpec;

/// A trajectory file around a shape.
std::string around(const std::string& shape) { return "tandem: trajectory/1\nname: t\nshape:\n  " + shape + "\n"; }

TrajectorySpec parseTrajectoryText(const std::string& text) { return parseTrajectory(text, "text", {}); }

void expectSame(const planning::Shape& a, const planning::Shape& b) {
  ASSERT_EQ(a.index(), b.index());
  const auto vectors = [](const planning::Shape& shape) -> std::vector<Eigen::Vector3d> {
    if (const auto* r = std::get_if<planning::Rectangle>(&shape))
      return {r->first, r->second};
    if (const auto* l = std::get_if<planning::Lissajous>(&shape))
      return {l->amplitude, l->cycles, l->phase};
    if (const auto* c = std::get_if<planning::Circle>(&shape)) {
      return {c->center_offset, c->normal, Eigen::Vector3d(c->turns, 0, 0)};
    }
    if (const auto* line = std::get_if<planning::Line>(&shape))
      return {line->displacement};
    if (const auto* insertion = std::get_if<planning::Insertion>(&shape)) {
      std::vector<Eigen::Vector3d> stages;
      for (const planning::InsertionStage& stage : insertion->stages)
        stages.emplace_back(stage.tubes, stage.length, 0);
      return stages;
    }
    const auto& waypoints = std::get<planning::Waypoints>(shape);
    std::vector<Eigen::Vector3d> points = waypoints.points;
    points.emplace_back(waypoints.absolute, 0, 0);
    return points;
  };
  const auto left = vectors(a);
  const auto right = vectors(b);
  ASSERT_EQ(left.size(), right.size());
  for (std::size_t i = 0; i < left.size(); ++i) {
    // The normal of a circle is orthogonalised and normalised again, hence not bitwise equal.
    EXPECT_LE((left[i] - right[i]).norm(), 1e-15 * (1.0 + right[i].norm())) << i;
  }
}

TEST(Trajectory, PresetsAreWhatTheDesignSays) {
  const TrajectorySpec rectangle = loadTrajectory(presets() / "trajectories/rectangle.yaml");
  EXPECT_EQ(rectangle.name, "rectangle");
  EXPECT_EQ(rectangle.arm, 0);
  EXPECT_EQ(rectangle.other_arm, 1);
  EXPECT_EQ(rectangle.point_count, 100);
  EXPECT_DOUBLE_EQ(rectangle.tolerance, 0.88e-3);
  EXPECT_TRUE(rectangle.relative.empty());
  EXPECT_EQ(rectangle.following, planning::Following::kTimed);
  EXPECT_DOUBLE_EQ(rectangle.speed, 2e-3);
  EXPECT_DOUBLE_EQ(rectangle.acceleration, 5e-3);
  EXPECT_TRUE(std::get<planning::Rectangle>(rectangle.shape).first.isApprox(Eigen::Vector3d(0, 0.02, 0)));
  EXPECT_TRUE(std::get<planning::Rectangle>(rectangle.shape).second.isApprox(Eigen::Vector3d(-0.02, 0, 0)));
  const auto lissajous = std::get<planning::Lissajous>(loadTrajectory(presets() / "trajectories/lissajous.yaml").shape);
  EXPECT_TRUE(lissajous.amplitude.isApprox(Eigen::Vector3d(0, 0.01, 0.01)));
  EXPECT_TRUE(lissajous.cycles.isApprox(Eigen::Vector3d(0, 1, 2)));
  EXPECT_EQ(lissajous.phase.norm(), 0.0);
}

TEST(Trajectory, EveryKeyReachesItsField) {
  const TrajectorySpec spec = parseTrajectoryText(
      "tandem: trajectory/1\nname: \"7\"\narm: 2\nother_arm: h\npoints: 12\nfollowing: timed\ntolerance_m: 0.002\n"
      "max_iterations: 34\npoint_duration_ms: 500\nspeed_mm_per_s: 3\nacceleration_m_per_s2: 0.5\n"
      "shape: {circle: {center_offset_mm: [3, 0, 0], normal: [0, 0, -2], turns: -1.5}}\n"
      "relative: {waypoints: {points_mm: [[1, 2, 3], [4, 5, 6]], absolute: true}}\n");
  EXPECT_EQ(spec.name, "7");
  EXPECT_EQ(spec.arm, 2);
  EXPECT_EQ(spec.other_arm, 7);
  EXPECT_EQ(spec.point_count, 12);
  EXPECT_EQ(spec.following, planning::Following::kTimed);
  EXPECT_DOUBLE_EQ(spec.tolerance, 0.002);
  EXPECT_EQ(spec.max_iterations, 34);
  EXPECT_DOUBLE_EQ(spec.point_duration, 0.5);
  EXPECT_DOUBLE_EQ(spec.speed, 0.003);
  EXPECT_DOUBLE_EQ(spec.acceleration, 0.5);
  expectSame(spec.shape, planning::Circle{{0.003, 0, 0}, {0, 0, -1}, -1.5});
  ASSERT_EQ(spec.relative.size(), 1u);
  expectSame(spec.relative[0], planning::Waypoints{{{1e-3, 2e-3, 3e-3}, {4e-3, 5e-3, 6e-3}}, true});
}

TEST(Trajectory, TasksSayWhatIsTracked) {
  const std::string line = "shape: {line: {displacement_mm: [1, 0, 0]}}\n", head = "tandem: trajectory/1\nname: x\n";
  const auto arms = [&](const std::string& tasks) {
    const TrajectorySpec spec = parseTrajectoryText(head + tasks + line);
    return std::pair{spec.arm, spec.other_arm};
  };
  EXPECT_EQ(arms("tasks: [{tip: c}]\n"), (std::pair{2, planning::kNoArm}));
  EXPECT_EQ(arms("tasks:\n  - relative: [b, 3]\n  - tip: b\n"), (std::pair{1, 3}));
  EXPECT_EQ(arms("arm: b\nother_arm: d\n"), (std::pair{1, 3}));
  const std::pair<const char*, const char*> refused[] = {
      {"tasks: [{tip: a}]\narm: a\n", "arm: found both tasks and arm, which is a short form of it"},
      {"tasks: [{tip: a}]\nrelative: hold\n", "relative: found without a task `relative: [a, b]`"},
      {"tasks: [{relative: [a, b]}]\n",
       "tasks: found other tasks, expected one `tip` or a `pose`, at most one `relative` before the tip"},
      {"tasks: [{tip: a}, {relative: [a, b]}]\n", "tasks: found other tasks"},
      {"tasks: [{tip: a}, {tip: b}]\n", "tasks[1]: found `tip` twice, expected it once"},
      {"tasks: [{relative: [b, a]}, {tip: a}]\n",
       "relative[0]: found another arm first than the one that follows the shape"},
      {"tasks: [{relative: [a, a]}, {tip: a}]\n", "tasks[0].relative"},
      {"tasks: [{relative: [a, b, c]}, {tip: a}]\n", "tasks[0].relative: found a list of 3, expected a list of 2"},
      {"tasks: [{tip: Left}]\n", "tasks[0].tip: found the text \"Left\", expected the name of an arm"},
      {"tasks: [{relative: [left, left]}, {tip: left}]\n", "tasks[0].relative"},
      {"arm: left\nother_arm: left\n", "other_arm: found the same arm twice"},
      {"tasks: []\n", "tasks: found an empty list"},
      {"tasks: [{tip: a, relative: [a, b]}]\n", "tasks[0]: found 2 keys, expected exactly one"},
  };
  for (const auto& [tasks, text] : refused) {
    try {
      arms(tasks);
      ADD_FAILURE() << tasks;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << tasks << error.what();
    }
  }
}

TEST(Trajectory, ArmsAreFoundByNameThenByLetterOrIndex) {
  Robot robot = loadRobot(presets() / "robots/ark2024.yaml");
  const auto found = [&](const std::string& tasks) {
    TrajectorySpec spec = parseTrajectoryText("tandem: trajectory/1\nname: x\ntasks: " + tasks +
                                              "\nshape: {line: {displacement_mm: [1, 0, 0]}}\n");
    const std::string wrong = findArms(spec, robot);
    if (wrong.empty()) {  // the text that planning receives names the same arms
      TrajectorySpec sent = parseTrajectoryText(formatTrajectory(spec));
      EXPECT_EQ(findArms(sent, robot), "");
      EXPECT_EQ(std::pair(sent.arm, sent.other_arm), std::pair(spec.arm, spec.other_arm)) << tasks;
    }
    return wrong.empty() ? std::to_string(spec.arm) + ' ' + std::to_string(spec.other_arm) : wrong;
  };
  EXPECT_EQ(found("[{tip: b}]"), "1 -1");
  robot.arms[0].name = "left";
  robot.arms[1].name = "right";
  EXPECT_EQ(found("[{relative: [right, left]}, {tip: right}]"), "1 0");
  EXPECT_EQ(found("[{relative: [b, a]}, {tip: b}]"), "1 0");
  EXPECT_EQ(found("[{tip: 1}]"), "1 -1");
  for (const auto& [name, arm] : {std::pair{"right", 1}, {"b", 1}, {"0", 0}})
    EXPECT_EQ(findArm(robot, name), std::optional<std::size_t>(arm)) << name;
  for (const char* name : {"c", "2", "", "arm_left", "Left", "-"})
    EXPECT_EQ(findArm(robot, name), std::nullopt) << name;
  EXPECT_EQ(found("[{tip: rigt}]"), "found arm rigt, expected left or right");
  EXPECT_EQ(found("[{relative: [a, c]}, {tip: a}]"), "found arm c, expected left or right");
  EXPECT_EQ(found("[{relative: [a, left]}, {tip: a}]"), "found the same arm twice, expected two arms");
  robot.arms[0].name = "arm_b";
  robot.arms[1].name = "a";
  EXPECT_EQ(found("[{relative: [a, b]}, {tip: a}]"), "1 0") << "a name is looked up before a letter";
  robot.arms.resize(1);
  EXPECT_EQ(found("[{tip: left}]"), "found arm left, expected b, the only arm of this robot; write tasks: [{tip: b}]");
}

TEST(Trajectory, DefaultsAreThoseOfTheStruct) {
  const TrajectorySpec spec = parseTrajectoryText(around("line: {displacement_mm: [1, 0, 0]}"));
  const TrajectorySpec usual;
  EXPECT_EQ(spec.arm, usual.arm);
  EXPECT_EQ(spec.other_arm, usual.other_arm);
  EXPECT_EQ(spec.point_count, usual.point_count);
  EXPECT_EQ(spec.following, usual.following);
  EXPECT_EQ(spec.tolerance, usual.tolerance);
  EXPECT_EQ(spec.max_iterations, usual.max_iterations);
  EXPECT_EQ(spec.point_duration, usual.point_duration);
  EXPECT_EQ(spec.speed, usual.speed);
  EXPECT_EQ(spec.acceleration, usual.acceleration);
  EXPECT_TRUE(spec.relative.empty());
}

/// Vectors and numbers of random size, never zero.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double number() { return std::exp(std::uniform_real_distribution<>(-12, 3)(engine_)); }
  int integer(int most) { return std::uniform_int_distribution<>(0, most)(engine_); }
  Eigen::Vector3d vector() { return Eigen::Vector3d(number(), -number(), number()); }
  /// @param most  4: those that a relative position can have, too; 5: with the own path of an arm
  planning::Shape shape(int most) {
    switch (integer(most)) {
      case 0:
        return planning::Rectangle{vector(), vector()};
      case 1:
        return planning::Lissajous{vector(), vector(), vector()};
      case 2: {
        const Eigen::Vector3d offset = vector();
        return planning::Circle{offset, offset.cross(vector()).normalized(), number()};
      }
      case 3:
        return planning::Line{vector()};
      case 5:
        return planning::Insertion{{{1 + integer(3), number()}, {1 + integer(3), number()}}};
      default:
        return planning::Waypoints{{vector(), vector(), vector()}, integer(1) == 1};
    }
  }

 private:
  std::mt19937 engine_;
};

TEST(Trajectory, FormattedTextReadsBack) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Random random(seed);
  for (int trial = 0; trial < 300; ++trial) {
    TrajectorySpec spec;
    spec.name = trial % 2 ? "12 \"quoted\": #" : "plain";
    spec.arm = random.integer(3);
    spec.other_arm = random.integer(1) ? 4 + random.integer(3) : planning::kNoArm;
    spec.shape = random.shape(5);
    if (spec.hasRelative() && random.integer(1))
      spec.relative.push_back(random.shape(4));
    spec.point_count = 1 + random.integer(1000);
    spec.following = random.integer(1) ? planning::Following::kTimed : planning::Following::kPointByPoint;
    spec.tolerance = random.number();
    spec.max_iterations = 1 + random.integer(1000);
    spec.point_duration = random.number();
    spec.speed = random.number();
    spec.acceleration = random.number();
    const std::string text = formatTrajectory(spec);
    SCOPED_TRACE(text);
    const TrajectorySpec back = parseTrajectoryText(text);
    EXPECT_EQ(back.name, spec.name);
    EXPECT_EQ(back.arm, spec.arm);
    EXPECT_EQ(back.other_arm, spec.other_arm);
    EXPECT_EQ(back.point_count, spec.point_count);
    EXPECT_EQ(back.following, spec.following);
    EXPECT_EQ(back.tolerance, spec.tolerance);
    EXPECT_EQ(back.max_iterations, spec.max_iterations);
    EXPECT_EQ(back.point_duration, spec.point_duration);
    EXPECT_EQ(back.speed, spec.speed);
    EXPECT_EQ(back.acceleration, spec.acceleration);
    expectSame(back.shape, spec.shape);
    ASSERT_EQ(back.relative.size(), spec.relative.size());
    if (!spec.relative.empty())
      expectSame(back.relative[0], spec.relative[0]);
    if (HasFailure())
      break;
  }
}

TEST(Trajectory, Refusals) {
  const auto load_file = [](const std::filesystem::path& file) { loadTrajectory(file); };
  const std::string circle = readAll(presets() / "trajectories/circle.yaml");
  const std::string shape = "circle: {center_offset_mm: [0, 10, 0], normal: [0, 0, 1], turns: 1}";
  const Refusal refusals[] = {
      {"arm: a", "arm: 8", "8\n", 0, "arm", "found 8, expected the name of an arm"},
      {"arm: a", "arm: b", "b\nother_arm: b", 13, "other_arm", "the same arm twice"},
      {"normal: [0, 0, 1]", "normal: [0, 1, 1]", "[0, 1, 1]", 0, "shape.circle.normal", "found an angle of 45 deg"},
      {"[0, 10, 0]", "[0, 0, 0]", "[0, 0, 0]", 0, "shape.circle.center_offset_mm", "expected a vector other than zero"},
      {"turns: 1", "turns: 0", "0}", 0, "shape.circle.turns", "found 0, expected another number"},
      {shape, "spiral: {}", "spiral", 0, "shape.spiral",
       "expected one of rectangle, lissajous, circle, line, waypoints, csv, insertion"},
      {"  " + shape, "  {}", "{}", 0, "shape", "found 0 keys, expected exactly one of rectangle"},
      {shape, shape + "\n  line: {displacement_mm: [1, 0, 0]}", "{displacement", 0, "shape",
       "found 2 keys, expected exactly one"},
      {shape, "line: {displacement_mm: [0, 0, 0]}", "[0, 0, 0]", 0, "shape.line.displacement_mm",
       "a vector other than zero"},
      {shape, "lissajous: {amplitude_mm: [1, 0, 0], cycles: [0, 1, 0]}", "[1, 0, 0]", 0, "shape.lissajous.amplitude_mm",
       "found no axis with both amplitude and cycles"},
      {shape, "waypoints: {points_mm: []}", "[]", 0, "shape.waypoints.points_mm",
       "found an empty list, expected a list of 1 to"},
      {shape, "waypoints: {points_mm: [[1, 2, 3], [1, 2]]}", "[1, 2]]", 0, "shape.waypoints.points_mm[1]",
       "found a list of 2, expected a list of 3"},
      {shape, "waypoints: {points_mm: [[1, 2, x]]}", "x]]", 0, "shape.waypoints.points_mm[0][2]",
       "found the text \"x\""},
      {shape, "csv: {file: none.csv}", "none.csv", 0, "shape.csv.file", "found no file"},
      {"relative: hold", "relative: free", "free", 0, "relative",
       "found the text \"free\", expected a mapping (shape), or hold"},
      {"points: 100", "points: 0", "0\nrelative", 0, "points", "found 0, expected an integer from 1 to 100000"},
      {"points: 100", "points: 1.5", "1.5", 0, "points", "found 1.5, expected an integer"},
      {"following: timed", "following: fast", "fast", 0, "following", "expected one of point_by_point, timed"},
      // Of all kinds of files, only a trajectory is read here.
      {"tandem: trajectory/1\n", "", "name: circle", 0, "tandem",
       "found the text \"name\" as the first key, expected trajectory/1 as the value of the first key `tandem`"},
      {"trajectory/1", "trajectry/1", "trajectry/1", 0, "tandem",
       "found the text \"trajectry/1\", expected trajectory/1 as the value of"},
      {"trajectory/1", "robot/1", "robot/1", 0, "tandem", "found robot/1, expected trajectory/1"},
  };
  for (const Refusal& refusal : refusals) {
    expectRefusal(circle, refusal, load_file);
  }
}

TEST(Trajectory, CsvBecomesWaypoints) {
  const Folder folder;
  folder.write("data/points.csv", "0.001,0,-1e-3\r\n 0.002 , 0.5e-3,0\n");
  const auto file = folder.write("t.yaml", around("csv: {file: data/points.csv, absolute: true}"));
  expectSame(loadTrajectory(file).shape, planning::Waypoints{{{1e-3, 0, -1e-3}, {2e-3, 5e-4, 0}}, true});
  // The wire carries the points, not the file.
  expectSame(parseTrajectoryText(formatTrajectory(loadTrajectory(file))).shape, loadTrajectory(file).shape);
}

TEST(Trajectory, CsvMayNameItsColumnsAndUnits) {
  const Folder folder;
  folder.write("points.csv", "name, z_mm ,x_mm,y\na,-1,1,0\nb,0, 2 ,5e-4\r\n");
  const auto file = folder.write("t.yaml", around("csv: {file: points.csv}"));
  expectSame(loadTrajectory(file).shape, planning::Waypoints{{{1e-3, 0, -1e-3}, {2e-3, 5e-4, 0}}, false});
}

TEST(Trajectory, BadCsvIsRefusedAtItsLine) {
  const Folder folder;
  const auto file = folder.write("t.yaml", around("csv: {file: points.csv}"));
  const std::tuple<const char*, int, int, const char*> cases[] = {
      {"", 1, 1, "found no points"},
      {"0,0,0\n1,2\n", 2, 1, "found 2 columns, expected three"},
      {"0,0,0\n1,2,3,4\n", 2, 7, "found '4' in column 4, expected three columns"},
      {"x,y,y,z\n0,0,0,0\n", 1, 1, "found column y twice"},
      {"x,y,z_deg\n0,0,0\n", 1, 1, "found no column z in 'x,y,z_deg', expected z_mm"},
      {"x,y,z\n0,0\n", 2, 1, "found 2 columns, expected the 3 of the header"},
      {"x,y,z\n0,0,?\n", 2, 5, "found '?' in column 3"},
      {"0,0,0\n0,nan,0\n", 2, 3, "found 'nan' in column 2"},
      {"0,0,0\n0,,0\n", 2, 3, "found '' in column 2"},
      {"0,0,0\n\n", 2, 1, "found '' in column 1"},
  };
  for (const auto& [text, line, column, message] : cases) {
    SCOPED_TRACE(text);
    const auto csv = folder.write("points.csv", text);
    try {
      loadTrajectory(file);
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(std::filesystem::path(error.file()).filename(), "points.csv");
      EXPECT_EQ(error.line(), line) << error.what();
      EXPECT_EQ(error.column(), column) << error.what();
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  }
}

TEST(Trajectory, TextsWithoutAFolderCannotNameFiles) {
  try {
    parseTrajectoryText(around("csv: {file: /etc/hostname}"));
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "text:4:15: shape.csv.file: found a file, expected `waypoints`: a trajectory sent as text "
                 "cannot refer to a file");
  }
}

}  // namespace
}  // namespace tandem::config::test
