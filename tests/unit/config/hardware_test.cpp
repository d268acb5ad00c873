// SPDX-License-Identifier: Apache-2.0
/** @file Hardware files. */
#include "hal/hardware.h"

#include <cmath>
#include <numbers>

#include "support.h"

namespace tandem::config::test {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

std::filesystem::path hardwarePreset() { return presets() / "hardware/ark2024-two-buses.yaml"; }

/// The preset with an absolute path to its robot, so that it loads from anywhere.
std::string good() {
  return replaced(readAll(hardwarePreset()), "../robots/ark2024.yaml", (presets() / "robots/ark2024.yaml").string());
}

void expectHardwareRefusal(const Refusal& refusal) {
  expectRefusal(good(), refusal, [](const auto& file) { loadHardware(file); });
}

hal::HardwareConfig loadText(const std::string& text) { return loadHardware(Folder().write("file.yaml", text)); }

TEST(Hardware, ThePresetMapsEveryJointOnce) {
  const hal::HardwareConfig hardware = loadHardware(hardwarePreset());
  EXPECT_TRUE(hardware.simulated);
  EXPECT_EQ(hardware.period, 4e-3);
  ASSERT_EQ(hardware.buses.size(), 2u);
  EXPECT_EQ(hardware.buses[1].bit_rate, 1e6);
  ASSERT_EQ(hardware.arms.size(), 2u);
  ASSERT_EQ(hardware.axes.size(), 12u);
  for (int i = 0; i < 12; ++i) {
    const hal::AxisConfig& axis = hardware.axes[static_cast<std::size_t>(i)];
    EXPECT_EQ(axis.arm, i / 6);
    EXPECT_EQ(axis.bus, i / 6);
    EXPECT_EQ(axis.joint, i % 6);
    EXPECT_EQ(axis.translation, i % 6 < 3);
    ASSERT_TRUE(axis.encoder.has_value());
    EXPECT_EQ(axis.node + 16, axis.encoder->node);
  }
  EXPECT_EQ(hardware.axes[9].name, "arm_b rotation 1");
  EXPECT_EQ(hardware.axes[0].gearing.travel_per_revolution, 2e-3);
  EXPECT_EQ(hardware.axes[3].gearing.travel_per_revolution, 2.0 * std::numbers::pi);
  EXPECT_NEAR(hardware.axes[11].encoder->gearing.offset, -270 * kDeg, 1e-15);
}

TEST(Hardware, LimitsAreThoseOfRobotAndDrive) {
  const hal::HardwareConfig hardware = loadHardware(hardwarePreset());
  const Robot robot = loadRobot(presets() / "robots/ark2024.yaml");
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t j = 0; j < 6; ++j) {
      const safety::JointLimit& cut = hardware.arms[a].limits.joints[j];
      const safety::JointLimit& whole = robot.arms[a].limits.joints[j];
      EXPECT_TRUE(std::isfinite(cut.lower) && std::isfinite(cut.upper) && std::isfinite(cut.velocity));
      EXPECT_GE(cut.lower, whole.lower);
      EXPECT_LE(cut.upper, whole.upper);
      EXPECT_LE(cut.velocity, whole.velocity);
    }
    EXPECT_EQ(hardware.arms[a].limits.rows.size(), robot.arms[a].limits.rows.size());
    EXPECT_EQ(hardware.arms[a].limits.joints[0].velocity, 5e-3);  // the robot's
    EXPECT_EQ(hardware.arms[a].limits.joints[3].velocity, 2.0);   // the drive's
  }
}

TEST(Hardware, AnArmHoldsWithoutPowerWhereAllItsAxesAreDeclaredTo) {
  hal::HardwareConfig hardware = loadHardware(hardwarePreset());
  EXPECT_EQ(hardware.axes[0].powerless_hold, hal::HoldingMeans::kSelfLocking);
  EXPECT_TRUE(hal::holdsWithoutPower(hardware, 0));
  hardware = loadText(replaced(good(), "holds_without_power: self_locking", "holds_without_power: brake"));
  EXPECT_EQ(hardware.axes[0].powerless_hold, hal::HoldingMeans::kBrake);
  EXPECT_TRUE(hal::holdsWithoutPower(hardware, 0));
  // Holding that is not declared does not count; one such axis is sufficient.
  hardware = loadText(replaced(good(), "      holds_without_power: self_locking\n", ""));
  EXPECT_EQ(hardware.axes[0].powerless_hold, hal::HoldingMeans::kNo);
  EXPECT_EQ(hardware.axes[3].powerless_hold, hal::HoldingMeans::kSelfLocking);
  EXPECT_FALSE(hal::holdsWithoutPower(hardware, 0));
}

TEST(Hardware, TheEmergencyStopIsReadWhereTheFileSays) {
  const hal::HardwareConfig preset = loadHardware(hardwarePreset());
  ASSERT_EQ(preset.emergency_stop.size(), 2u);
  EXPECT_EQ(preset.emergency_stop[1].axis, 6);
  EXPECT_EQ(preset.emergency_stop[1].bit, 16);
  EXPECT_FALSE(preset.emergency_stop[1].statusword);
  EXPECT_TRUE(preset.emergency_stop[1].active_low);
  EXPECT_TRUE(hal::readsInputs(preset, preset.axes[6]));
  EXPECT_FALSE(hal::readsInputs(preset, preset.axes[7]));
  // A separate PDO, which the load calculation includes: SYNC, two PDOs of six drives, those of six encoders.
  EXPECT_EQ(hal::computeLoad(preset.planOf(0, 0.1)).frames_per_cycle, 1 + 12 + 6 + 1);
  // Without a node: every drive of the bus. The statusword is mapped in any case.
  const hal::HardwareConfig sto = loadText(replaced(good(), "{bus: bus_b, node: 1, input_bit: 16, active: low}",
                                                    "{bus: bus_b, statusword_bit: 14, active: high}"));
  ASSERT_EQ(sto.emergency_stop.size(), 7u);
  EXPECT_EQ(sto.emergency_stop[6].axis, 11);
  EXPECT_TRUE(sto.emergency_stop[6].statusword);
  EXPECT_FALSE(sto.emergency_stop[6].active_low);
  EXPECT_EQ(hal::computeLoad(sto.planOf(1, 0.1)).frames_per_cycle, 1 + 12 + 6);
}

TEST(Hardware, SlewIsLimitedUnlessTheFileLiftsTheLimit) {
  // The robot's own limit is unlimited: in simulation the paper's commands jump.
  const Robot robot = loadRobot(presets() / "robots/ark2024.yaml");
  EXPECT_EQ(robot.arms[0].limits.joints[0].slew_limit, safety::kUnlimited);
  const hal::HardwareConfig preset = loadHardware(hardwarePreset());
  for (const hal::ArmConfig& arm : preset.arms) {
    EXPECT_DOUBLE_EQ(arm.limits.joints[0].slew_limit, 0.1);  // 10 mm/s within 0.1 s
    EXPECT_DOUBLE_EQ(arm.limits.joints[3].slew_limit, 20.0);
    EXPECT_DOUBLE_EQ(arm.limits.joints[0].slew_limit, arm.limits.joints[0].stop_deceleration);
    EXPECT_DOUBLE_EQ(arm.limits.joints[3].slew_limit, arm.limits.joints[3].stop_deceleration);
  }
  const std::string key = "velocity_mm_per_s: 10\n";
  const auto slew_of = [&](const std::string& more) {
    return loadText(replaced(good(), key, key + "      " + more + "\n")).arms[0].limits.joints[0].slew_limit;
  };
  EXPECT_EQ(slew_of("slew_limit_mm_per_s2: unlimited"), safety::kUnlimited);
  EXPECT_EQ(slew_of("slew_limit_m_per_s2: 0.04"), 0.04);
}

TEST(Hardware, TorqueIsWatchedWhereTheFileHasALimit) {
  EXPECT_EQ(loadHardware(hardwarePreset()).axes[0].torque.object, 0);
  const std::string key = "holds_without_power: self_locking\n";
  hal::HardwareConfig hardware =
      loadText(replaced(good(), key, key + "      torque_limit: {limit_per_mille: 800, time_ms: 70}\n"));
  EXPECT_EQ(hardware.axes[0].torque.object, 0x6077);
  EXPECT_EQ(hardware.axes[0].torque.limit, 0.8);
  EXPECT_EQ(hardware.axes[0].torque.time, 0.07);
  EXPECT_EQ(hardware.axes[3].torque.object, 0);
  // Two more bytes in the feedback of three drives.
  const hal::HardwareConfig plain = loadHardware(hardwarePreset());
  const double more =
      hal::computeLoad(hardware.planOf(0, 0.1)).cycle_bits - hal::computeLoad(plain.planOf(0, 0.1)).cycle_bits;
  EXPECT_EQ(more, 3.0 * (hal::frameBits(8) - hal::frameBits(6)));
  hardware = loadText(replaced(good(), key, key + "      torque_limit: {object: current, limit_per_mille: 1500}\n"));
  EXPECT_EQ(hardware.axes[0].torque.object, 0x6078);
}

TEST(Hardware, DrivesHaveTheirOwnUnitsModesAndAnswers) {
  const std::string key = "holds_without_power: self_locking\n";
  const auto with = [&](const std::string& keys) { return loadText(replaced(good(), key, key + keys)).axes[0]; };
  const hal::AxisConfig plain = loadHardware(hardwarePreset()).axes[0];
  EXPECT_EQ(plain.units.velocity, hal::RateUnit::kCounts);
  EXPECT_TRUE(plain.reports_following);
  EXPECT_EQ(plain.sdo_timeout, 0.1);
  const hal::AxisConfig axis = with(
      "      mode: pv\n      velocity_unit: rpm\n      velocity_unit_scale: 1000\n      acceleration_unit: rev_per_s2\n"
      "      acceleration_unit_scale: 10\n      sdo_timeout_ms: 250\n      reports_following: false\n");
  EXPECT_EQ(axis.mode, hal::DriveMode::kProfileVelocity);
  EXPECT_FALSE(axis.reports_following);
  EXPECT_EQ(axis.sdo_timeout, 0.25);
  const hal::AxisUnits units(axis.gearing, axis.units);
  EXPECT_EQ(units.toVelocityNumber(-10e-3), -3'000'000) << "50 revolutions per second, in thousandths of rpm";
  EXPECT_EQ(units.toAccelerationNumber(0.2), 10'000) << "1000 revolutions per square second, in tenths";
  EXPECT_EQ(units.toCountMagnitude(1e-3), 20'480u) << "distances are counts";
}

TEST(Hardware, AVelocityThatADriveCannotHoldIsRefused) {
  const std::string key = "holds_without_power: self_locking\n";
  try {
    loadText(replaced(good(), key, key + "      velocity_unit: rpm\n      velocity_unit_scale: 1e6\n"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what())
                  .find("arm_a translation 1: found a velocity that is 3000000000 in the drive's unit (object 60FF), "
                        "expected 1 to 2147483647"),
              std::string::npos)
        << error.what();
  }
}

TEST(Hardware, EveryKeyReachesItsField) {
  std::string text = good();
  text = replaced(text, "holds_without_power: self_locking\n",
                  "holds_without_power: self_locking\n"
                  "      slew_limit_mm_per_s2: 300\n"
                  "      torque_limit: {object: current, limit_per_mille: 900, time_ms: 80}\n");
  text = replaced(text, "{bus: bus_b, node: 1, input_bit: 16, active: low}",
                  "{bus: bus_b, statusword_bit: 14, active: high}");
  text = replaced(text, "feedback_budget_ms: 300\n", "");
  text = replaced(
      text, "simulated: true\n",
      "simulated: true\nnode_heartbeat_ms: 40\nfeedback_budget_ms: 25\nboot_budget_s: 5\ntransition_budget_s: 0.3\n"
      "power_budget_s: 3\n");
  text = replaced(text, "bit_rate_kbit_per_s: 1000}", "bit_rate_kbit_per_s: 900, load_limit: 0.7, node_id: 120}");
  text = replaced(text, "reference: absolute_encoder",
                  "reference: homing\n      temperature_scale: 0.1\n      mode: csv\n      velocity_gain_per_s: 12\n   "
                  "   vendor: 0x12\n"
                  "      product: 34\n      revision: 0xFFFFFFFF\n"
                  "      homing: {method: 17, fast_mm_per_s: 4, slow_mm_per_s: 1, acceleration_mm_per_s2: 50, order: 2,"
                  " budget_s: 90}");
  text = replaced(text, "tolerance_mm: 0.3}", "tolerance_mm: 0.4, vendor: 9, product: 8, revision: 7}");
  text = replaced(text, "node: 1, lower_mm: -437, upper_mm: 0,",
                  "node: 1, lower_mm: -430, upper_mm: -1, serial: 4711, reversed: true, offset_mm: 3, "
                  "encoder_serial: 0x4712, encoder_reversed: true, home_position_mm: -400,");
  text = replaced(text, "tube: 2, bus: bus_a, node: 2,", "tube: 2, bus: bus_a, node: 2, home_position_mm: -300,");
  text = replaced(text, "tube: 3, bus: bus_a, node: 3,", "tube: 3, bus: bus_a, node: 3, home_position_mm: -190,");
  text = replaced(text, "tube: 1, bus: bus_b, node: 1,", "tube: 1, bus: bus_b, node: 1, home_position_mm: -400,");
  text = replaced(text, "tube: 2, bus: bus_b, node: 2,", "tube: 2, bus: bus_b, node: 2, home_position_mm: -300,");
  text = replaced(text, "tube: 3, bus: bus_b, node: 3,", "tube: 3, bus: bus_b, node: 3, home_position_mm: -190,");
  const hal::HardwareConfig hardware = loadText(text);
  EXPECT_EQ(hardware.node_heartbeat, 0.04);
  EXPECT_EQ(hardware.feedback_budget, 0.025);
  EXPECT_EQ(hardware.boot_budget, 5.0);
  EXPECT_EQ(hardware.transition_budget, 0.3);
  EXPECT_EQ(hardware.power_budget, 3.0);
  EXPECT_EQ(hardware.buses[0].bit_rate, 9e5);
  EXPECT_EQ(hardware.buses[0].load_limit, 0.7);
  EXPECT_EQ(hardware.buses[0].node_id, 120);
  const hal::AxisConfig& axis = hardware.axes[0];
  EXPECT_EQ(axis.reference, hal::PositionReference::kHoming);
  EXPECT_EQ(axis.mode, hal::DriveMode::kCyclicVelocity);
  EXPECT_EQ(axis.velocity_gain, 12.0);
  EXPECT_EQ(axis.identity.vendor, 0x12u);
  EXPECT_EQ(axis.identity.product, 34u);
  EXPECT_EQ(axis.identity.revision, 0xFFFFFFFFu);
  EXPECT_EQ(axis.identity.serial, 4711u);
  EXPECT_EQ(axis.temperature_index, 0x2001);
  EXPECT_EQ(axis.temperature_sub, 0);
  EXPECT_EQ(axis.temperature_scale, 0.1);
  EXPECT_EQ(axis.homing.method, 17);
  EXPECT_EQ(axis.homing.fast, 4e-3);
  EXPECT_EQ(axis.homing.slow, 1e-3);
  EXPECT_EQ(axis.homing.acceleration, 0.05);
  EXPECT_EQ(axis.homing.order, 2);
  EXPECT_EQ(axis.homing.budget, 90.0);
  EXPECT_EQ(axis.homing.position, -0.4);
  EXPECT_TRUE(axis.gearing.reversed);
  EXPECT_EQ(axis.gearing.offset, 3e-3);
  EXPECT_EQ(axis.lower, -0.43);
  EXPECT_EQ(axis.upper, -1e-3);
  EXPECT_EQ(axis.velocity, 0.01);
  EXPECT_EQ(axis.quick_stop_deceleration, 0.2);
  EXPECT_EQ(axis.slew_limit, 0.3);
  EXPECT_EQ(axis.torque.object, 0x6078);
  EXPECT_EQ(axis.torque.limit, 0.9);
  EXPECT_EQ(axis.torque.time, 0.08);
  EXPECT_EQ(axis.following_error, 1e-3);
  EXPECT_EQ(axis.following_time, 0.1);
  EXPECT_EQ(axis.encoder->tolerance, 0.4e-3);
  EXPECT_EQ(axis.encoder->identity.vendor, 9u);
  EXPECT_EQ(axis.encoder->identity.product, 8u);
  EXPECT_EQ(axis.encoder->identity.revision, 7u);
  EXPECT_EQ(axis.encoder->identity.serial, 0x4712u);
  EXPECT_TRUE(axis.encoder->gearing.reversed);
  EXPECT_EQ(axis.encoder->gearing.offset, -0.15);
  EXPECT_EQ(axis.encoder->gearing.counts_per_revolution, 65536.0);
}

TEST(Hardware, Refusals) {
  const auto refuse = [](const std::string& from, const std::string& to, const std::string& at, std::size_t offset,
                         const std::string& key, const std::string& message) {
    expectHardwareRefusal({from, to, at, offset, key, message});
  };
  refuse("simulated: true", "simulated: false", "robot: ", 7, "robot", "expected `hardware: true`");
  refuse("period_ms: 4", "period_ms: 4.05", "4.05", 0, "period_ms", "a multiple of 0.1 ms");
  refuse("unix:/tmp/tandem-bus-b", "unix:/tmp/tandem-bus-a", "name: bus_b", 24, "buses[1].interface", "a second time");
  refuse("name: bus_b,", "name: bus_a,", "name: bus_a, interface: \"unix:/tmp/tandem-bus-b", 6, "buses[1].name",
         "a second time");
  refuse("tube: 2, bus: bus_a, node: 2,", "tube: 2, bus: bus_a, node: 1,", "tube: 2, bus: bus_a, node: 1,", 27,
         "translations[0].axes[1].node", "a second time on bus_a");
  refuse("tube: 2, bus: bus_a, node: 2,", "tube: 2, bus: bus_a, node: 127,", "node: 127", 6,
         "translations[0].axes[1].node", "the HAL's own id included");
  refuse("tube: 2, bus: bus_a, node: 2,", "tube: 1, bus: bus_a, node: 2,", "tube: 1, bus: bus_a, node: 2,", 6,
         "translations[0].axes[1].tube", "a second time");
  refuse("tube: 2, bus: bus_a, node: 2,", "tube: 2, bus: bus_c, node: 2,", "bus_c", 0, "translations[0].axes[1].bus",
         "expected one of the buses");
  refuse("arm: arm_b, tube: 3, bus: bus_b, node: 6", "arm: arm_c, tube: 3, bus: bus_b, node: 6", "arm_c", 0,
         "rotations[0].axes[5].arm", "expected an arm of the robot: arm_a, arm_b");
  refuse("lower_mm: -437", "lower_mm: 1", "lower_mm: 1", 10, "translations[0].axes[0].lower_mm", "expected less than");
  refuse("encoder_node: 17,", "", "{arm: arm_a, tube: 1, bus: bus_a", 0, "translations[0].axes[0].encoder_node",
         "expected one");
  refuse("{bus: bus_a, node: 1, input_bit: 16,", "{bus: bus_c, node: 1, input_bit: 16,", "bus_c", 0,
         "emergency_stop[0].bus", "expected one of the buses");
  refuse("{bus: bus_a, node: 1, input_bit: 16,", "{bus: bus_a, node: 9, input_bit: 16,", "node: 9", 6,
         "emergency_stop[0].node", "expected the node of a drive on bus");
  refuse("node: 1, input_bit: 16,", "node: 1, ", "bus_a, node: 1,  active", 0, "emergency_stop[0].bus",
         "expected one of input_bit and statusword_bit");
  refuse("node: 1, input_bit: 16,", "node: 1, statusword_bit: 6,", "statusword_bit: 6", 16,
         "emergency_stop[0].statusword_bit", "part of the drive's state");
  refuse("following_error_mm: 1", "following_error_mm: 0.00001", "node: 1, lower", 6, "translations[0].axes[0].node",
         "expected at least two counts of this axis");
  refuse("counts_per_revolution: 4096\n      gear_ratio: 10\n",
         "counts_per_revolution: 4096000000\n      gear_ratio: 10\n", "upper_mm: 0", 10,
         "translations[0].axes[0].upper_mm", "expected at most 2^30");
  for (const auto& [fast, slow, key] : {std::array{"10.125", "1", "fast"}, std::array{"10", "27.75", "slow"}}) {
    const std::string homing = "homing: {method: 17, fast_mm_per_s: " + std::string(fast) + ", slow_mm_per_s: " + slow +
                               ", acceleration_mm_per_s2: 50}";
    refuse("reference: absolute_encoder", "reference: homing\n      " + homing,
           std::string(key) == "fast" ? fast : slow, 0,
           "translations[0].drive.homing." + std::string(key) + "_mm_per_s", "times `velocity` of the drive");
  }
  refuse("reference: absolute_encoder", "reference: homing", "reference: homing", 11, "translations[0].drive.reference",
         "expected a `homing` mapping");
}

TEST(Hardware, AJointWithoutAnAxisIsRefused) {
  std::string text = good();
  const std::size_t from = text.find("      - {arm: arm_a, tube: 3, bus: bus_a, node: 3");
  const std::size_t to = text.find("      - {arm: arm_b", from);
  text.erase(from, to - from);
  try {
    loadText(text);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("no axis for tube 3 of arm_a"), std::string::npos) << error.what();
  }
}

TEST(Hardware, ABusBeyondItsLimitIsRefusedWithWhatWouldFit) {
  try {
    loadText(replaced(good(), "period_ms: 4", "period_ms: 3"));
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_EQ(error.key(), "buses[0]");
    EXPECT_NE(text.find("over the limit of 60 %"), std::string::npos) << text;
    EXPECT_NE(text.find("what would fit: a period of "), std::string::npos) << text;
  }
}

TEST(Hardware, CarriagesThatWouldNotHomeTogetherAreRefused) {
  const auto homing = [](const std::string& text, const std::string& positions, const std::string& method = "17") {
    std::string result = replaced(text, "reference: absolute_encoder",
                                  "reference: homing\n      homing: {method: " + method +
                                      ", fast_mm_per_s: 4, slow_mm_per_s: 1, acceleration_mm_per_s2: 50}");
    for (const std::string bus : {"bus_a", "bus_b"}) {
      for (int tube = 1; tube <= 3; ++tube) {
        const std::string key = "tube: " + std::to_string(tube) + ", bus: " + bus + ", node: " + std::to_string(tube);
        const std::string position = positions.substr(5 * static_cast<std::size_t>(tube - 1), 4);
        result = replaced(result, key + ",", key + ", home_position_mm: " + position + ",");
      }
    }
    return result;
  };
  EXPECT_NO_THROW(loadText(homing(good(), "-400 -300 -190")));
  EXPECT_THROW(loadText(homing(good(), "-300 -310 -190")), Error) << "carriage 2 behind carriage 1";
  for (int method = -128; method <= 127; ++method) {
    SCOPED_TRACE(method);
    const bool turns = (method >= 7 && method <= 14) || (method >= 23 && method <= 30);
    const bool reserved =
        method == 0 || method == 15 || method == 16 || method == 31 || method == 32 || method == 36 || method > 37;
    try {
      loadText(homing(good(), "-400 -300 -190", std::to_string(method)));
      EXPECT_FALSE(turns || reserved || method < 0) << "accepted";
    } catch (const Error& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(method < 0 ? "a number of the manufacturer"
                          : reserved ? "which CiA 402-2 reserves"
                                     : "may turn around at a limit switch"),
                std::string::npos)
          << text;
      EXPECT_TRUE(turns || reserved || method < 0) << text;
    }
  }
}

TEST(Hardware, ADeploymentNamesItsHardware) {
  const Deployment deployment = loadDeployment(presets() / "deployments/drives.yaml");
  EXPECT_EQ(deployment.hardware, hardwarePreset());
  EXPECT_TRUE(loadDeployment(presets() / "deployments/laptop.yaml").hardware.empty());
  const Folder folder;
  const std::string text =
      replaced(readAll(presets() / "deployments/drives.yaml"), "../robots/ark2024.yaml", "ark2024");
  const auto file =
      folder.write("file.yaml", replaced(text, "../hardware/ark2024-two-buses.yaml", "ark2024-two-buses"));
  EXPECT_EQ(loadDeployment(file).hardware, hardwarePreset());
}

}  // namespace
}  // namespace tandem::config::test
