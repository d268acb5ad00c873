// SPDX-License-Identifier: Apache-2.0
/** @file Deployments. */
#include <numbers>

#include "config/deployment_copy.h"
#include "support.h"

namespace tandem::config::test {
namespace {

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
  EXPECT_EQ(plant.tube_deviation.residual_curvature, 0.2);
  EXPECT_EQ(plant.friction, 0.02);
  EXPECT_DOUBLE_EQ(plant.clearance, 0.03e-3);
  EXPECT_DOUBLE_EQ(plant.ovality, 0.01e-3);
  const sim::FixedTubeErrors& fixed = plant.tube_errors.at(0);
  EXPECT_EQ(fixed.arm, 1);
  EXPECT_EQ(fixed.tube, 2);
  EXPECT_EQ(fixed.errors.bending_stiffness, 0.1);
  EXPECT_EQ(fixed.errors.torsional_stiffness, -0.2);
  EXPECT_EQ(fixed.errors.curvature, 0.3);
  EXPECT_EQ(fixed.errors.length, 0.005);
  EXPECT_EQ(fixed.errors.residual_curvature, -0.4);
  EXPECT_EQ(plant.tip_forces.at(0).arm, 0);
  EXPECT_EQ(plant.tip_forces.at(0).force, Eigen::Vector3d(0.1, 0.0, -0.2));
  EXPECT_TRUE(plant.tracker.present);
  EXPECT_EQ(plant.tracker.rate, 60.0);
  EXPECT_EQ(plant.tracker.position_noise, 0.3e-3);
  EXPECT_EQ(plant.tracker.rotation_noise, 0.01);
  EXPECT_EQ(plant.tracker.delay, 0.03);
  EXPECT_EQ(plant.tracker.drop_out, 0.125);
  EXPECT_EQ(plant.tracker.delay_variation, 0.005);
  EXPECT_EQ(plant.tracker.bias, Eigen::Vector3d(1e-3, -2e-3, 0.0));
  EXPECT_EQ(plant.tracker.rotation_bias, Eigen::Vector3d(0.01, 0.0, -0.02));
  EXPECT_FALSE(plant.tracker.orientations);
  EXPECT_DOUBLE_EQ(plant.tracker.distortion, 0.4e-3);
  EXPECT_DOUBLE_EQ(plant.tracker.distortion_period, 0.15);
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
memory_limit_mb: 900
budgets:
  minimum_age_ms: 20
  age_periods: 2
  planning_reference_s: 0.2
  teleoperation_ms: 90
  drive_heartbeat_ms: 80
  lease_s: 1.5
  lock_step_s: 40
  lost_samples: 0.02
  tip_measurement_ms: 70
  clearance_ms: 80
method: snsqp
method_library: lib/own.so
relative_gain_per_s: 4
tip_gain_per_s: 2
model: compliant
feedback: sensor
orientation_feedback: sensor
plant:
  model: compliant
  seed: 9
  motors: {delay_ms: 3, lag_translation_ms: 20, lag_rotation_ms: 10, backlash_translation_mm: 0.05, backlash_rotation_deg: 180}
  encoders: {resolution_translation_mm: 0.001, resolution_rotation_rad: 0.01, noise_translation_mm: 0.002, noise_rotation_rad: 0.02}
  tube_deviation: {bending_stiffness: 0.01, torsional_stiffness: 0.02, curvature: 0.03, length: 0.04, residual_curvature_per_m: 0.2}
  tube_friction: 0.02
  tube_clearance_mm: 0.03
  tube_ovality_mm: 0.01
  tube_errors:
    - {arm: arm_b, tube: 3, bending_stiffness: 0.1, torsional_stiffness: -0.2, curvature: 0.3, length: 0.005, residual_curvature_per_m: -0.4}
  tip_forces:
    - {arm: arm_a, force_N: [0.1, 0, -0.2]}
  tracker: {rate_Hz: 60, position_noise_mm: 0.3, rotation_noise_rad: 0.01, delay_ms: 30, drop_out: 0.125, delay_variation_ms: 5, bias_mm: [1, -2, 0],
            rotation_bias_rad: [0.01, 0, -0.02], orientations: false, distortion_mm: 0.4, distortion_period_mm: 150}
processes:
  - {name: sim, executable: /opt/sim, arguments: [--quiet, "7"], service: false, essential: false}
black_box: {before_s: 20, after_ms: 1500, memory_mb: 64, directory: box, files: 3, topics: ["control/*", stop]}
discovery: {server: 10.0.0.1, port: 11900}
teleoperation:
  scale: 0.25
  scale_rate_per_s: 2
  deadband_speed_mm_per_s: 1
  deadband_distance_mm: 0.2
  filter_min_cutoff_Hz: 3
  filter_beta_per_m: 100
  filter_derivative_cutoff_Hz: 4
  max_speed_mm_per_s: 15
  leash_mm: 2
  response_ms: 80
  orientation: axis
  rotation_scale: 0.4
  deadband_angular_speed_rad_per_s: 0.01
  deadband_angle_rad: 0.02
  filter_rotation_beta: 6
  max_angular_speed_rad_per_s: 0.25
  leash_angle_rad: 0.05
  workspace: {min_mm: [-50, -50, 0], max_mm: [50, 50, 300]}
  forbidden:
    - {name: vessel, sphere: {center_mm: [0, 0, 100], radius_mm: 5}}
    - {name: wall, half_space: {point_mm: [0, 0, 290], normal: [0, 0, -2]}}
    - {name: bone, box: {min_mm: [1, 2, 3], max_mm: [4, 5, 6]}}
  margin_mm: 0.5
  guidance: {points_mm: [[0, 0, 0], [0, 0, 50]], strength: 0.5, radius_mm: 7}
  crtk: {commands: false, clients: [a, b c], stamps: arrival, tip_step_mm: 1, tip_rotation_step_rad: 0.03, translation_step_mm: 3, rotation_step_deg: 1.8, acceleration_mm_per_s2: 30,
         angular_acceleration_rad_per_s2: 2}
cycle_log: cycles
console: {address: 10.0.0.1, port: 9000, certificate: c.pem, key: k.pem, operator_token: o, viewer_token: v, origins: ["https://a.example:1"]}
idle_power_off_s: 45
emergency_stop_topic_ms: 400
least_clearance_mm: -0.2
)";
  // Keys that exclude these are in the file of another test.
  expectEveryKey(text + kHosts + "security: credentials", deploymentTable());
  const Deployment d = loadDeployment(folder.write("d.yaml", text));
  EXPECT_EQ(d.name, "lab");
  EXPECT_EQ(d.idle_power_off, 45.0);
  EXPECT_EQ(d.emergency_stop_budget, 0.4);
  EXPECT_NEAR(d.least_clearance, -0.0002, 1e-15);
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
  EXPECT_EQ(d.cycle_log.filename(), "cycles");
  EXPECT_EQ(d.black_box.topics, (std::vector<std::string>{"control/*", "stop"}));
  const planning::teleoperation::Options& o = d.teleoperation.options;
  EXPECT_EQ(o.scale, 0.25);
  EXPECT_EQ(o.scale_rate, 2.0);
  EXPECT_EQ(o.deadband_speed, 1e-3);
  EXPECT_DOUBLE_EQ(o.deadband_distance, 0.2e-3);
  EXPECT_EQ(o.filter.min_cutoff, 3.0);
  EXPECT_EQ(o.filter.beta, 100.0);
  EXPECT_EQ(o.filter.derivative_cutoff, 4.0);
  EXPECT_EQ(o.guard.max_speed, 0.015);
  EXPECT_EQ(o.guard.leash, 2e-3);
  EXPECT_EQ(o.guard.response, 0.08);
  EXPECT_EQ(o.rotation.followed, planning::teleoperation::TipOrientation::kAxis);
  EXPECT_TRUE(o.rotation.space().axis_only);
  EXPECT_EQ(o.rotation.scale, 0.4);
  EXPECT_EQ(o.rotation.deadband_speed, 0.01);
  EXPECT_EQ(o.rotation.deadband_angle, 0.02);
  EXPECT_EQ(o.rotation.filter_beta, 6.0);
  EXPECT_EQ(o.rotation.max_speed, 0.25);
  EXPECT_EQ(o.rotation.leash, 0.05);
  EXPECT_EQ(o.guard.margin, 0.5e-3);
  ASSERT_TRUE(o.guard.workspace.has_value());
  EXPECT_EQ(o.guard.workspace->maximum, Eigen::Vector3d(0.05, 0.05, 0.3));
  ASSERT_EQ(o.guard.forbidden.size(), 3u);
  EXPECT_EQ(std::get<planning::teleoperation::Sphere>(o.guard.forbidden[0].shape).radius, 5e-3);
  EXPECT_EQ(std::get<planning::teleoperation::HalfSpace>(o.guard.forbidden[1].shape).normal, -Eigen::Vector3d::UnitZ());
  EXPECT_EQ(std::get<planning::teleoperation::Box>(o.guard.forbidden[2].shape).minimum,
            Eigen::Vector3d(1e-3, 2e-3, 3e-3));
  ASSERT_TRUE(o.guard.guidance.has_value());
  EXPECT_EQ(o.guard.guidance->points[1], Eigen::Vector3d(0, 0, 0.05));
  EXPECT_EQ(o.guard.guidance->strength, 0.5);
  EXPECT_EQ(o.guard.guidance->radius, 7e-3);
  const Crtk& crtk = d.teleoperation.crtk;
  EXPECT_FALSE(crtk.commands);
  EXPECT_EQ(crtk.clients, (std::vector<std::string>{"a", "b c"}));
  EXPECT_TRUE(crtk.by_arrival);
  EXPECT_EQ(crtk.tip_rotation_step, 0.03);
  EXPECT_EQ(crtk.angular_acceleration, 2.0);
  EXPECT_EQ(crtk.tip_step, 1e-3);
  EXPECT_EQ(crtk.translation_step, 3e-3);
  EXPECT_DOUBLE_EQ(crtk.rotation_step, 0.01 * std::numbers::pi);
  EXPECT_EQ(crtk.acceleration, 0.03);
  EXPECT_EQ(d.console.address, "10.0.0.1");
  EXPECT_EQ(d.console.port, 9000);
  EXPECT_EQ(d.console.certificate.filename(), "c.pem");
  EXPECT_EQ(d.console.key.filename(), "k.pem");
  EXPECT_EQ(d.console.operator_token.filename(), "o");
  EXPECT_EQ(d.console.viewer_token.filename(), "v");
  EXPECT_EQ(d.console.origins, (std::vector<std::string>{"https://a.example:1"}));
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
  EXPECT_EQ(d.memory_limit, 900);
  EXPECT_EQ(d.budgets.minimum_age, 0.02);
  EXPECT_EQ(d.budgets.age_periods, 2.0);
  EXPECT_EQ(d.budgets.planning_reference, 0.2);
  EXPECT_EQ(d.budgets.teleoperation, 0.09);
  EXPECT_EQ(d.budgets.drive_heartbeat, 0.08);
  EXPECT_EQ(d.budgets.lease, 1.5);
  EXPECT_EQ(d.budgets.lock_step, 40.0);
  EXPECT_EQ(d.budgets.lost_samples, 0.02);
  EXPECT_EQ(d.method, control::Method::kSnsqp);
  EXPECT_EQ(d.method_library, folder.path() / "lib/own.so");
  EXPECT_EQ(d.relative_gain, 4.0);
  EXPECT_EQ(d.tip_gain, 2.0);
  EXPECT_EQ(d.processes.at(0).executable, "/opt/sim");
  EXPECT_EQ(d.processes.at(0).arguments, (std::vector<std::string>{"--quiet", "7"}));
  EXPECT_FALSE(d.processes.at(0).is_service);
  EXPECT_EQ(d.budgets.tip_measurement, 0.07);
  EXPECT_EQ(d.budgets.clearance, 0.08);
  EXPECT_EQ(d.model, "compliant");
  EXPECT_EQ(d.feedback, planning::Feedback::kSensor);
  EXPECT_EQ(d.orientation_feedback, planning::Feedback::kSensor);
  expectPlant(d.plant);
  ASSERT_EQ(d.warnings.size(), 1u);
  EXPECT_NE(d.warnings[0].find("25:12: budgets.lease_s: found 1.5 s, expected at most the default of 1 s"),
            std::string::npos)
      << d.warnings[0];
}

TEST(Deployment, Refusals) {
  const auto load_file = [](const std::filesystem::path& file) { loadDeployment(file); };
  const std::string good = readAll(presets() / "deployments/laptop.yaml");
  const Refusal refusals[] = {
      {"domain: 0", "domain: 233", "233", 0, "domain", "found 233, expected an integer from 0 to 232"},
      {"prefix: tandem", "prefix: /tandem", "/tandem\n", 0, "prefix", "expected a name of lower-case letters"},
      {"interface_address: 127.0.0.1", "interface_address: 256.0.0.1", "256", 0, "interface_address",
       "expected an IPv4 address"},
      {"[127.0.0.1]", "[localhost]", "localhost", 0, "peers[0]",
       "found the text \"localhost\", expected an IPv4 address"},
      {"clock: real_time", "clock: sundial", "sundial", 0, "clock", "expected one of real_time, lock_step"},
      {"clock: real_time", "clock: lock_step\nleast_clearance_mm: 1.25", "1.25", 0, "least_clearance_mm",
       "found together with clock: lock_step"},
      {"clock: real_time", "clock: lock_step\nemergency_stop_topic_ms: 300", "300", 0, "emergency_stop_topic_ms",
       "expected clock: real_time"},
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
      {"method: nspqp", "method: nspqp\norientation_feedback: sensor", "sensor", 0, "orientation_feedback",
       "found orientation_feedback: sensor with feedback: model, expected feedback: sensor, too"},
      {"method: nspqp", "method: nspqp\nconsole: {address: 0.0.0.0, operator_token: t}", "0.0.0.0", 0,
       "console.address", "found 0.0.0.0, which other machines reach, without TLS; expected certificate and key"},
      {"method: nspqp", "method: nspqp\nconsole: {address: 10.0.0.1, certificate: c, key: k}", "10.0.0.1", 0,
       "console.address", "without tokens; expected operator_token"},
      {"method: nspqp", "method: nspqp\nconsole: {certificate: c}", "c}", 0, "console.certificate", "expected both"},
      {"method: nspqp", "method: nspqp\nconsole: {viewer_token: v}", "v}", 0, "console.viewer_token",
       "found viewer_token without operator_token"},
      {"method: nspqp", "method: nspqp\nconsole: {origins: [tools.example]}", "tools.example", 0, "console.origins[0]",
       "expected SCHEME://HOST"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusalBesideRobot(good, refusal, load_file);
}

TEST(Deployment, ACopyOfADeploymentIsReadWithCompanionsElsewhere) {
  const auto original = presets() / "deployments/drives.yaml";
  const Folder folder;
  const auto copy = folder.write("copy.yaml", readAll(original) + "security: of-the-original\n");
  EXPECT_THROW(loadDeployment(copy), Error);
  const CompanionFiles companions{folder.write("r.yaml", readAll(presets() / "robots/ark2024.yaml")),
                                  folder.write("h.yaml", readAll(presets() / "hardware/ark2024-two-buses.yaml"))};
  const Deployment read = loadDeployment(copy, companions);
  EXPECT_EQ(read.robot, companions.robot);
  EXPECT_EQ(read.hardware, companions.hardware);
  EXPECT_EQ(read.values, loadDeployment(original).values);
  EXPECT_TRUE(loadDeployment(copy, {companions.robot, {}}).hardware.empty());
}

}  // namespace
}  // namespace tandem::config::test
