// SPDX-License-Identifier: Apache-2.0
/** @file Experiments, summaries. */
#include <cmath>
#include <numbers>

#include "support.h"

namespace tandem::config::test {
namespace {

TEST(Experiment, Table3IsTheProtocolOfThePaper) {
  const Experiment experiment = loadExperiment(presets() / "experiments/table3.yaml");
  EXPECT_EQ(experiment.name, "table3");
  EXPECT_EQ(experiment.robot, presets() / "robots/ark2024.yaml");
  EXPECT_EQ(experiment.relative_gain, 5.0);
  EXPECT_EQ(experiment.tip_gain, 3.0);
  using control::Method;
  EXPECT_EQ(experiment.methods, (std::vector{Method::kNspwln, Method::kNspwlnJoint, Method::kNspqp, Method::kSnsqp}));
  // Table 2, mm and degrees.
  const double table2[3][2][6] = {
      {{-100, -80, -50, 45, 45, 45}, {-80, -60, -30, 45, 45, 45}},
      {{-150, -100, -50, 180, 90, 45}, {-130, -120, -100, 90, -60, -270}},
      {{-250, -200, -120, 0, 0, 0}, {-250, -200, -120, 0, 0, 0}},
  };
  ASSERT_EQ(experiment.configurations.size(), 3u);
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(experiment.configurations[c].name, std::to_string(c + 1));
    ASSERT_EQ(experiment.configurations[c].joints.size(), 2u);
    for (int arm = 0; arm < 2; ++arm) {
      for (int i = 0; i < 6; ++i) {
        const double expected = table2[c][arm][i] * (i < 3 ? 1e-3 : std::numbers::pi / 180.0);
        EXPECT_NEAR(experiment.configurations[c].joints[arm][i], expected, 1e-15);
      }
    }
  }
}

TEST(Experiment, Table3HasTheTrajectoriesAndThePublishedRows) {
  const Experiment experiment = loadExperiment(presets() / "experiments/table3.yaml");
  ASSERT_EQ(experiment.trajectories.size(), 3u);
  const auto rectangle = [&](int i) { return std::get<planning::Rectangle>(experiment.trajectories[i].spec.shape); };
  EXPECT_EQ(experiment.trajectories[0].configurations, (std::vector<std::string>{"1"}));
  EXPECT_TRUE(rectangle(0).first.isApprox(Eigen::Vector3d(-0.02, 0, 0)));
  EXPECT_TRUE(rectangle(0).second.isApprox(Eigen::Vector3d(0, 0, 0.02)));
  EXPECT_EQ(experiment.trajectories[1].configurations, (std::vector<std::string>{"2", "3"}));
  EXPECT_TRUE(rectangle(1).first.isApprox(Eigen::Vector3d(0, 0.02, 0)));
  EXPECT_TRUE(rectangle(1).second.isApprox(Eigen::Vector3d(-0.02, 0, 0)));
  EXPECT_EQ(experiment.trajectories[2].configurations, (std::vector<std::string>{"1", "2", "3"}));
  for (const ExperimentTrajectory& trajectory : experiment.trajectories) {
    EXPECT_EQ(trajectory.spec.point_count, 100);
    EXPECT_EQ(trajectory.spec.max_iterations, 100);
    EXPECT_DOUBLE_EQ(trajectory.spec.tolerance, 0.88e-3);
  }
  const std::tuple<const char*, const char*, int, double, double> rows[] = {
      {"rectangle", "nspwln", 523, 0.35, 0.82}, {"rectangle", "nspqp", 269, 0.02, 0.81},
      {"rectangle", "snsqp", 261, 0.05, 0.74},  {"lissajous", "nspwln", 513, 0.33, 0.81},
      {"lissajous", "nspqp", 279, 0.09, 0.75},  {"lissajous", "snsqp", 259, 0.13, 0.76},
  };
  ASSERT_EQ(experiment.published.size(), std::size(rows));
  for (std::size_t i = 0; i < std::size(rows); ++i) {
    const auto& [trajectory, method, iterations, max_ab, max_a] = rows[i];
    EXPECT_EQ(experiment.published[i].trajectory, trajectory);
    EXPECT_EQ(experiment.published[i].method, method);
    EXPECT_EQ(experiment.published[i].iterations, iterations);
    EXPECT_DOUBLE_EQ(experiment.published[i].max_ab, max_ab / 1e3);
    EXPECT_DOUBLE_EQ(experiment.published[i].max_a, max_a / 1e3);
  }
  EXPECT_DOUBLE_EQ(experiment.published[0].rms_ab, 0.33e-3);
  EXPECT_DOUBLE_EQ(experiment.published[0].std_ab, 0.05e-3);
  EXPECT_DOUBLE_EQ(experiment.published[5].rms_a, 0.71e-3);
  EXPECT_DOUBLE_EQ(experiment.published[5].std_a, 0.10e-3);
}

TEST(Experiment, WhatIsNotPublishedIsNotANumber) {
  const Folder folder;
  std::string text = readAll(presets() / "experiments/table3.yaml");
  text = replaced(text, "../robots/ark2024.yaml", (presets() / "robots/ark2024.yaml").string());
  text = replaced(text, "    iterations: 523\n    relative: {rms_mm: 0.33, std_mm: 0.05, max_mm: 0.35}\n", "");
  const PublishedRow row = loadExperiment(folder.write("e.yaml", text)).published[0];
  EXPECT_TRUE(std::isnan(row.iterations));
  EXPECT_TRUE(std::isnan(row.rms_ab) && std::isnan(row.std_ab) && std::isnan(row.max_ab));
  EXPECT_DOUBLE_EQ(row.rms_a, 0.79e-3);
}

TEST(Experiment, Refusals) {
  const auto load_file = [](const std::filesystem::path& file) { loadExperiment(file); };
  const std::string good = readAll(presets() / "experiments/table3.yaml");
  const Refusal refusals[] = {
      {"methods: [nspwln, nspwln-joint", "methods: [nspwln, magic", "magic", 0, "methods[1]",
       "found the text \"magic\", expected one of"},
      {"methods: [nspwln, nspwln-joint", "methods: [nspwln, nspwln", "nspwln, nspqp", 0, "methods[1]", "a second time"},
      {"arm: arm_a", "arm: arm_c", "arm_c", 0, "configurations[0].joints[0].arm",
       "expected an arm of the robot: arm_a, arm_b"},
      {"arm: arm_b", "arm: arm_a", "arm_a, beta_mm: [-80", 0, "configurations[0].joints[1].arm",
       "found 'arm_a' a second time"},
      {"[-100, -80, -50]", "[-100, -120, -50]", "-120, -50", 0, "configurations[0].joints[0].beta_mm[1]",
       "carriage spacing"},
      {"[45, 45, 45]", "[45, 45]", "[45, 45]", 0, "configurations[0].joints[0].alpha_deg", "expected a list of 3"},
      {"      - {arm: arm_b, beta_mm: [-80, -60, -30], alpha_deg: [45, 45, 45]}\n", "", "- {arm: arm_a", 0,
       "configurations[0].joints", "found no entry for 'arm_b'"},
      {"name: \"2\"", "name: \"1\"", "\"1\"\n    joints:\n      - {arm: arm_a, beta_mm: [-150", 0,
       "configurations[1].name", "found '1' a second time"},
      {"configurations: [\"2\", \"3\"]", "configurations: [\"2\", \"4\"]", "\"4\"", 0,
       "trajectories[1].configurations[1]", "found '4', expected one of 1, 2, 3"},
      {"configurations: [\"2\", \"3\"]", "configurations: [\"1\"]",
       "rectangle\n    configurations: [\"1\"]\n    shape:\n      rectangle: {first_mm: [0", 0, "trajectories[1].name",
       "found 'rectangle' from configuration 1 a second time"},
      {"    points: 100", "    other_arm: c\n    points: 100", "c\n    points", 0, "trajectories[0].other_arm",
       "found arm c, expected a or b"},
      {"- trajectory: rectangle", "- trajectory: circle", "circle", 0, "published[0].trajectory",
       "found 'circle', expected the name"},
      {"iterations: 523", "iterations: -1", "-1\n    relative", 0, "published[0].iterations", "found -1"},
      {"relative_gain_per_s: 5", "relative_gain: 5", "relative_gain:", 0, "relative_gain",
       "expected relative_gain_per_s"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusalBesideRobot(good, refusal, load_file);
  expectRefusal(
      good,
      {"../robots/ark2024.yaml", "nobody", "nobody", 0, "robot", "one of the presets: ark2024, ark2024-as-printed"},
      load_file);
}

TEST(Experiment, ErrorsOfTheRobotFileNameTheRobotFile) {
  const Folder folder;
  const auto robot = folder.write("robots/ark2024.yaml", "tandem: robot/1\nname: x\narms: []\n");
  const auto file = folder.write("experiments/e.yaml", readAll(presets() / "experiments/table3.yaml"));
  try {
    loadExperiment(file);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(std::filesystem::path(error.file()), robot);
    EXPECT_EQ(error.line(), 3);
    EXPECT_EQ(error.key(), "arms");
  }
}

TEST(Validate, ReportsTheKindOfAFile) {
  const std::tuple<const char*, const char*, const char*, std::size_t> cases[] = {
      {"robots/ark2024.yaml", "robot",
       "robot ark2024: 2 arms (arm_a: 3 tubes, 6 joints; arm_b: 3 tubes, 6 joints), simulated", 6},
      {"experiments/table3.yaml", "experiment",
       "experiment table3: robot ark2024, 3 configurations, 3 trajectories, 4 methods (nspwln, nspwln-joint, nspqp, "
       "snsqp), "
       "24 runs",
       6},
      {"deployments/lockstep.yaml", "deployment",
       "deployment lockstep: robot ark2024, lock-step, control period 100 ms, nspqp, 3 processes (sim, control, "
       "planning)",
       6},
      {"trajectories/circle.yaml", "trajectory",
       "trajectory circle: circle of arm a, 100 points, relative position to arm b held", 0},
  };
  for (const auto& [file, kind, text, warnings] : cases) {
    const Summary summary = validate(presets() / file);
    EXPECT_EQ(summary.kind, kind);
    EXPECT_EQ(summary.text, text);
    EXPECT_EQ(summary.warnings.size(), warnings);
  }
}

TEST(Validate, UnknownKindsAreRefused) {
  const auto check = [](const std::filesystem::path& file) { validate(file); };
  const std::string good = "tandem: robot/1\n";
  expectRefusal(good, {"robot/1", "submarine/1", "submarine", 0, "tandem", "expected robot/1 or cooperative/1"}, check);
  expectRefusal(good, {"robot/1", "", "tandem", 0, "tandem", "found nothing"}, check);
  expectRefusal(good, {"tandem: robot/1", "{}", "{}", 0, "tandem", "found no key"}, check);
}

TEST(Validate, EveryPresetIsGood) {
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(presets())) {
    if (entry.path().extension() != ".yaml")
      continue;
    const std::string kind = validate(entry.path()).kind;
    const std::string folder = entry.path().parent_path().filename();
    EXPECT_TRUE(folder == kind || folder == kind + "s" || (folder == "trajectories" && kind == "trajectory"))
        << entry.path();
    ++count;
  }
  EXPECT_GE(count, 10);
}

}  // namespace
}  // namespace tandem::config::test
