// SPDX-License-Identifier: Apache-2.0
/** @file Experiments, deployments, summaries. */
#include <cmath>
#include <numbers>

#include "support.h"
#include "teleoperation_keys.h"

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
       "found arm 2, expected less than the robot's 2 arms"},
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

TEST(Deployment, Presets) {
  const Deployment lockstep = loadDeployment(presets() / "deployments/lockstep.yaml");
  EXPECT_EQ(lockstep.clock, ClockMode::kLockStep);
  EXPECT_EQ(lockstep.control_period, 0.1);
  EXPECT_EQ(lockstep.robot, presets() / "robots/ark2024.yaml");
  ASSERT_EQ(lockstep.processes.size(), 3u);
  for (const auto& [index, name] : {std::pair{0, "sim"}, {1, "control"}, {2, "planning"}}) {
    EXPECT_EQ(lockstep.processes[index].name, name);
    EXPECT_EQ(lockstep.processes[index].executable, std::string("tandem-") + name);
    EXPECT_TRUE(lockstep.processes[index].arguments.empty());
  }
  const Deployment laptop = loadDeployment(presets() / "deployments/laptop.yaml");
  EXPECT_EQ(laptop.clock, ClockMode::kRealTime);
  EXPECT_EQ(laptop.control_period, 0.1);
  EXPECT_EQ(laptop.peers, std::vector<std::string>{"127.0.0.1"});
  const Deployment fast = loadDeployment(presets() / "deployments/laptop-1khz.yaml");
  EXPECT_EQ(fast.clock, ClockMode::kRealTime);
  EXPECT_EQ(fast.control_period, 1e-3);
  EXPECT_EQ(fast.sim_period, 1e-3);
  EXPECT_TRUE(fast.warnings.empty());
}

void expectPlant(const sim::PlantOptions& plant) {
  EXPECT_EQ(plant.model, "compliant");
  EXPECT_EQ(plant.seed, 9u);
  EXPECT_EQ(plant.mechanics.delay, 0.003);
  EXPECT_EQ(plant.mechanics.lag.translation, 0.02);
  EXPECT_EQ(plant.mechanics.lag.rotation, 0.01);
  EXPECT_EQ(plant.mechanics.backlash.translation, 0.05e-3);
  EXPECT_DOUBLE_EQ(plant.mechanics.backlash.rotation, std::numbers::pi);
  EXPECT_EQ(plant.encoders.resolution.translation, 1e-6);
  EXPECT_EQ(plant.encoders.resolution.rotation, 0.01);
  EXPECT_EQ(plant.encoders.noise.translation, 2e-6);
  EXPECT_EQ(plant.encoders.noise.rotation, 0.02);
  EXPECT_EQ(plant.tube_deviation.bending_stiffness, 0.01);
  EXPECT_EQ(plant.tube_deviation.torsional_stiffness, 0.02);
  EXPECT_EQ(plant.tube_deviation.curvature, 0.03);
  EXPECT_EQ(plant.tube_deviation.length, 0.04);
  const sim::GivenTubeErrors& given = plant.tube_errors.at(0);
  EXPECT_EQ(given.arm, 1);
  EXPECT_EQ(given.tube, 2);
  EXPECT_EQ(given.errors.bending_stiffness, 0.1);
  EXPECT_EQ(given.errors.torsional_stiffness, -0.2);
  EXPECT_EQ(given.errors.curvature, 0.3);
  EXPECT_EQ(given.errors.length, 0.005);
  EXPECT_EQ(plant.tip_forces.at(0).arm, 0);
  EXPECT_EQ(plant.tip_forces.at(0).force, Eigen::Vector3d(0.1, 0.0, -0.2));
  EXPECT_TRUE(plant.tracker.present);
  EXPECT_EQ(plant.tracker.rate, 60.0);
  EXPECT_EQ(plant.tracker.position_noise, 0.3e-3);
  EXPECT_EQ(plant.tracker.rotation_noise, 0.01);
  EXPECT_EQ(plant.tracker.delay, 0.03);
  EXPECT_EQ(plant.tracker.drop_out, 0.125);
}

TEST(Deployment, EveryKeyReachesItsField) {
  const Folder folder;
  const std::string text = R"(tandem: deployment/1
name: lab
robot: ark2024-as-printed
hardware: ark2024-two-buses
prefix: lab_1
port: {radius_mm: 6, depth_mm: 2}
domain: 232
interface_address: 10.0.0.255
peers: [10.0.0.1, 10.0.0.2]
clock: real_time
control_period_ms: 20
sim_period_ms: 2
sim_translation_acceleration_mm_per_s2: 300
sim_rotation_acceleration_rad_per_s2: 40
status_period_s: 0.2
realtime_priority: 80
lock_memory: true
budgets:
  minimum_age_ms: 20
  age_periods: 2
  planning_reference_s: 0.2
  teleoperation_ms: 90
  drive_heartbeat_ms: 80
  lease_s: 1.5
  tip_measurement_ms: 70
method: snsqp
relative_gain_per_s: 4
tip_gain_per_s: 2
model: compliant
feedback: sensor
plant:
  model: compliant
  seed: 9
  motors: {delay_ms: 3, lag_translation_ms: 20, lag_rotation_ms: 10, backlash_translation_mm: 0.05, backlash_rotation_deg: 180}
  encoders: {resolution_translation_mm: 0.001, resolution_rotation_rad: 0.01, noise_translation_mm: 0.002, noise_rotation_rad: 0.02}
  tube_deviation: {bending_stiffness: 0.01, torsional_stiffness: 0.02, curvature: 0.03, length: 0.04}
  tube_errors:
    - {arm: arm_b, tube: 3, bending_stiffness: 0.1, torsional_stiffness: -0.2, curvature: 0.3, length: 0.005}
  tip_forces:
    - {arm: arm_a, force_N: [0.1, 0, -0.2]}
  tracker: {rate_Hz: 60, position_noise_mm: 0.3, rotation_noise_rad: 0.01, delay_ms: 30, drop_out: 0.125}
processes:
  - {name: sim, executable: /opt/sim, arguments: [--quiet, "7"], service: false, essential: false}
black_box: {before_s: 20, after_ms: 1500, memory_mb: 64, directory: box, files: 3, topics: ["control/*", stop]}
discovery: {server: 10.0.0.1, port: 11900}
teleoperation:
  {scale: 0.25, scale_rate_per_s: 2, deadband_speed_mm_per_s: 1, deadband_distance_mm: 2, filter_min_cutoff_Hz: 3,
   filter_beta_per_m: 40, filter_derivative_cutoff_Hz: 5, max_speed_mm_per_s: 6, leash_mm: 7, response_ms: 80, margin_mm: 9,
   workspace: {min_mm: [-1, -2, -3], max_mm: [1, 2, 3]},
   forbidden: [{name: a, sphere: {center_mm: [1, 2, 3], radius_mm: 4}}, {name: b, box: {min_mm: [0, 0, 0], max_mm: [1, 1, 1]}},
               {name: c, half_space: {point_mm: [0, 0, 1], normal: [0, 0, 2]}}],
   guidance: {points_mm: [[0, 0, 0], [0, 0, 5]], strength: 0.5, radius_mm: 8},
   crtk: {stamps: arrival, tip_step_mm: 3, translation_step_mm: 4, rotation_step_deg: 180, acceleration_mm_per_s2: 5}}
console: {address: 10.0.0.1, port: 9000, certificate: c.pem, key: k.pem, operator_token: o, viewer_token: v, origins: ["https://a.example:1"]}
)";
  // Those that exclude one another are in the file of another test.
  expectEveryKey(text + kHosts + "security: credentials", deploymentTable());
  const Deployment d = loadDeployment(folder.write("d.yaml", text));
  EXPECT_EQ(d.name, "lab");
  EXPECT_EQ(d.robot.filename(), "ark2024-as-printed.yaml");
  EXPECT_EQ(d.hardware.filename(), "ark2024-two-buses.yaml");
  EXPECT_EQ(d.prefix, "lab_1");
  ASSERT_TRUE(d.port.has_value());
  EXPECT_EQ(d.port->radius, 0.006);
  EXPECT_EQ(d.port->depth, 0.002);
  EXPECT_EQ(d.domain, 232);
  EXPECT_EQ(d.interface_address, "10.0.0.255");
  EXPECT_EQ(d.peers, (std::vector<std::string>{"10.0.0.1", "10.0.0.2"}));
  EXPECT_FALSE(d.processes[0].essential);
  EXPECT_EQ(d.black_box.before, 20.0);
  EXPECT_EQ(d.black_box.after, 1.5);
  EXPECT_EQ(d.black_box.memory, 64);
  EXPECT_EQ(d.black_box.directory.filename(), "box");
  EXPECT_EQ(d.black_box.files, 3);
  EXPECT_EQ(d.black_box.topics, (std::vector<std::string>{"control/*", "stop"}));
  EXPECT_EQ(d.console.address, "10.0.0.1");
  EXPECT_EQ(d.console.port, 9000);
  EXPECT_EQ(d.console.certificate.filename(), "c.pem");
  EXPECT_EQ(d.console.key.filename(), "k.pem");
  EXPECT_EQ(d.console.operator_token.filename(), "o");
  EXPECT_EQ(d.console.viewer_token.filename(), "v");
  EXPECT_EQ(d.console.origins, (std::vector<std::string>{"https://a.example:1"}));
  expectTeleoperation(d.teleoperation);
  ASSERT_TRUE(d.discovery.has_value());
  EXPECT_EQ(d.discovery->address, "10.0.0.1");
  EXPECT_EQ(d.discovery->port, 11900);
  EXPECT_EQ(d.clock, ClockMode::kRealTime);
  EXPECT_EQ(d.control_period, 0.02);
  EXPECT_EQ(d.sim_period, 0.002);
  EXPECT_EQ(d.sim_translation_acceleration, 0.3);
  EXPECT_EQ(d.sim_rotation_acceleration, 40.0);
  EXPECT_EQ(d.status_period, 0.2);
  EXPECT_EQ(d.realtime_priority, 80);
  EXPECT_TRUE(d.lock_memory);
  EXPECT_EQ(d.budgets.minimum_age, 0.02);
  EXPECT_EQ(d.budgets.age_periods, 2.0);
  EXPECT_EQ(d.budgets.planning_reference, 0.2);
  EXPECT_EQ(d.budgets.teleoperation, 0.09);
  EXPECT_EQ(d.budgets.drive_heartbeat, 0.08);
  EXPECT_EQ(d.budgets.lease, 1.5);
  EXPECT_EQ(d.method, control::Method::kSnsqp);
  EXPECT_EQ(d.relative_gain, 4.0);
  EXPECT_EQ(d.tip_gain, 2.0);
  EXPECT_EQ(d.processes.at(0).executable, "/opt/sim");
  EXPECT_EQ(d.processes.at(0).arguments, (std::vector<std::string>{"--quiet", "7"}));
  EXPECT_FALSE(d.processes.at(0).is_service);
  EXPECT_EQ(d.budgets.tip_measurement, 0.07);
  EXPECT_EQ(d.model, "compliant");
  EXPECT_EQ(d.feedback, planning::Feedback::kSensor);
  expectPlant(d.plant);
  ASSERT_EQ(d.warnings.size(), 1u);
  EXPECT_NE(d.warnings[0].find("24:12: budgets.lease_s: found 1.5 s, expected at most the default of 1 s"),
            std::string::npos)
      << d.warnings[0];
}

TEST(Deployment, Refusals) {
  const auto load_file = [](const std::filesystem::path& file) { loadDeployment(file); };
  const std::string good = readAll(presets() / "deployments/laptop.yaml");
  const Refusal refusals[] = {
      {"domain: 0", "domain: 233", "233", 0, "domain", "found 233, expected an integer from 0 to 232"},
      {"prefix: tandem", "prefix: /tandem", "/tandem\n", 0, "prefix", "expected a name of small letters"},
      {"interface_address: 127.0.0.1", "interface_address: 256.0.0.1", "256", 0, "interface_address",
       "expected an IPv4 address"},
      {"[127.0.0.1]", "[localhost]", "localhost", 0, "peers[0]",
       "found the text \"localhost\", expected an IPv4 address"},
      {"clock: real_time", "clock: sundial", "sundial", 0, "clock", "expected one of real_time, lock_step"},
      {"sim_period_ms: 1\n", "sim_period_ms: 200\n", "200", 0, "sim_period_ms",
       "found a sim_period of 0.2 s and a control_period of 0.1 s"},
      {"control_period_s", "control_period_Hz", "control_period_Hz", 0, "control_period_Hz",
       "'Hz' is not a unit of a time here; expected control_period_s or control_period_ms"},
      {"name: control, e", "name: sim, e", "sim, executable: tandem-control", 0, "processes[1].name",
       "found 'sim' a second time"},
      {"method: nspqp", "method: best", "best", 0, "method", "expected one of nsp, nspwln"},
      {"method: nspqp", "method: nspqp\nmodel: elastic", "elastic", 0, "model", "expected one of rigid, compliant"},
      {"method: nspqp", "method: nspqp\nplant: {model: compliant, tip_forces: [{arm: arm_c, force_N: [0, 0, 1]}]}",
       "arm_c", 0, "plant.tip_forces[0].arm", "found 'arm_c', expected an arm of the robot: arm_a, arm_b"},
      {"method: nspqp", "method: nspqp\nplant: {tip_forces: [{arm: arm_a, force_N: [0, 0, 1]}]}", "[{arm: arm_a", 0,
       "plant.tip_forces", "expected model: compliant"},
      {"method: nspqp", "method: nspqp\nplant: {tube_errors: [{arm: arm_a, tube: 4}]}", "4}]}", 0,
       "plant.tube_errors[0].tube", "found 4, expected 1 to 3"},
      {"clock: real_time", "clock: lock_step\nfeedback: sensor", "sensor", 0, "feedback", "expected plant.tracker"},
      {"method: nspqp", "method: nspqp\nconsole: {address: 0.0.0.0, operator_token: t}", "0.0.0.0", 0,
       "console.address", "found 0.0.0.0, which other machines reach, without TLS; expected certificate and key"},
      {"method: nspqp", "method: nspqp\nconsole: {address: 10.0.0.1, certificate: c, key: k}", "10.0.0.1", 0,
       "console.address", "without tokens; expected operator_token"},
      {"method: nspqp", "method: nspqp\nconsole: {certificate: c}", "c}", 0, "console.certificate", "expected both"},
      {"method: nspqp", "method: nspqp\nconsole: {viewer_token: v}", "v}", 0, "console.viewer_token",
       "found without operator_token"},
      {"method: nspqp", "method: nspqp\nconsole: {origins: [tools.example]}", "tools.example", 0, "console.origins[0]",
       "expected SCHEME://HOST"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusalBesideRobot(good, refusal, load_file);
}

TEST(Validate, TellsWhatAFileIs) {
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
       "trajectory circle: circle of arm 0, 100 points, relative position to arm 1 held", 0},
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
  expectRefusal(good, {"robot/1", "submarine/1", "submarine", 0, "tandem", "expected robot/1 or experiment/1"}, check);
  expectRefusal(good, {"robot/1", "", "tandem", 0, "tandem", "found nothing"}, check);
  expectRefusal(good, {"tandem: robot/1", "{}", "{}", 0, "tandem", "found no key"}, check);
}

TEST(Validate, EveryPresetIsGood) {
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(presets())) {
    if (!entry.is_regular_file())
      continue;
    const std::string kind = validate(entry.path()).kind;
    EXPECT_EQ(entry.path().parent_path().filename(), kind == "trajectory" ? "trajectories"
                                                     : kind == "hardware" ? kind
                                                                          : kind + "s");
    ++count;
  }
  EXPECT_GE(count, 10);
}

}  // namespace
}  // namespace tandem::config::test
