// SPDX-License-Identifier: Apache-2.0
/** @file References of hardware files: mechanical stops, encoders that drives read, the tolerance of a jump; and limit
 * switches. */
#include "hal/hardware.h"

#include <regex>

#include "support.h"

namespace tandem::config::test {
namespace {

const std::string kEncoder = "reference: absolute_encoder";

/// The preset; its linear stages have these lines instead of an encoder's reference.
std::string withReference(const std::string& lines) {
  const std::string preset = replaced(readAll(presets() / "hardware/ark2024-two-buses.yaml"), "../robots/ark2024.yaml",
                                      (presets() / "robots/ark2024.yaml").string());
  const std::string text = replaced(preset, kEncoder, lines);
  return lines.starts_with(kEncoder) ? text : withHomes(text);
}

hal::HardwareConfig loadReference(const std::string& lines) {
  const Folder folder;
  return loadHardware(folder.write("file.yaml", withReference(lines)));
}

void refuseReference(const std::string& lines, const std::string& key, const std::string& message) {
  SCOPED_TRACE(lines);
  try {
    loadReference(lines);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.key(), key);
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
  }
}

TEST(HardwareReference, AMechanicalStopHasATorqueAndASpeed) {
  const std::string stop =
      "{direction: positive, speed_mm_per_s: 3, torque_per_mille: 250, time_ms: 80, order: 2, budget_s: 30}";
  const hal::HardwareConfig hardware = loadReference("reference: hard_stop\n      hard_stop: " + stop);
  const hal::AxisConfig& axis = hardware.axes[0];
  EXPECT_EQ(axis.reference, hal::PositionReference::kHardStop);
  EXPECT_TRUE(axis.needsRun());
  EXPECT_TRUE(axis.hard_stop.positive);
  EXPECT_EQ(axis.hard_stop.speed, 3e-3);
  EXPECT_EQ(axis.hard_stop.torque, 0.25);
  EXPECT_EQ(axis.hard_stop.time, 0.08);
  EXPECT_EQ(axis.homing.order, 2);
  EXPECT_EQ(axis.homing.budget, 30.0);
  EXPECT_EQ(axis.homing.position, -0.4);
  EXPECT_EQ(axis.feedbackTorque(), 0x6077) << "the run reads it";
  EXPECT_EQ(hardware.trafficOf(0, 0.1).feedback[8], 3);
}

TEST(HardwareReference, AMechanicalStopIsRefusedWithItsKey) {
  const auto stop = [](const std::string& speed, const std::string& time, const std::string& more = "") {
    return "reference: hard_stop\n      " + more + "hard_stop: {direction: negative, speed_mm_per_s: " + speed +
           ", torque_per_mille: 250, time_ms: " + time + "}";
  };
  const std::string key = "translations[0].drive.";
  EXPECT_NO_THROW(loadReference(stop("5", "100"))) << "1 mm of following error";
  refuseReference(stop("5.1", "100"), key + "hard_stop.speed_mm_per_s", "half of `following_error`");
  refuseReference(stop("11", "20"), key + "hard_stop.speed_mm_per_s", "expected at most `velocity`");
  refuseReference("reference: hard_stop", key + "reference", "expected a `hard_stop` mapping");
  refuseReference(replaced(stop("1", "20"), "reference: hard_stop", "reference: drive"), key + "hard_stop",
                  "expected `reference: hard_stop`");
  refuseReference(stop("1", "20", "torque_limit: {object: current, limit_per_mille: 900}\n      "),
                  key + "torque_limit", "expected `torque`");
  refuseReference(replaced(stop("1", "20"), "torque_per_mille: 250", "torque_per_mille: 5"),
                  key + "hard_stop.torque_per_mille", "10");
}

TEST(HardwareReference, AJumpIsOfAnAbsolutePosition) {
  EXPECT_EQ(loadReference(kEncoder).axes[0].jump_tolerance, 0.0);
  EXPECT_EQ(loadReference(kEncoder + "\n      jump_tolerance_mm: 0.5").axes[0].jump_tolerance, 0.5e-3);
  refuseReference(
      "reference: hard_stop\n      jump_tolerance_mm: 0.5\n      hard_stop: {direction: negative, "
      "speed_mm_per_s: 1, torque_per_mille: 250}",
      "translations[0].drive.jump_tolerance_mm", "expected `reference: absolute_encoder`, `drive` or `measured`");
  EXPECT_EQ(loadReference("reference: measured\n      jump_tolerance_mm: 0.5").axes[0].reference,
            hal::PositionReference::kMeasured);
}

/// The preset with an encoder at the drives of the linear stages, and without their encoder nodes. @param keys  of the
/// first axis
hal::HardwareConfig loadEncoderAtDrive(const std::string& keys) {
  std::string text = replaced(withReference(kEncoder), "encoder: {", "encoder: {drive_input: 2, ");
  const std::size_t end = text.find("rotations:");
  text = std::regex_replace(text.substr(0, end), std::regex("encoder_node: \\d+,\\s*"), "") + text.substr(end);
  const std::string first = "tube: 1, bus: bus_a, node: 1, ";
  const Folder folder;
  return loadHardware(folder.write("file.yaml", replaced(text, first, first + keys)));
}

TEST(HardwareReference, AnEncoderMayBeReadByTheDrive) {
  const hal::HardwareConfig hardware = loadEncoderAtDrive("");
  EXPECT_EQ(hardware.axes[0].encoder->drive_input, 2);
  EXPECT_FALSE(hardware.axes[0].hasEncoderNode());
  EXPECT_TRUE(hardware.axes[3].hasEncoderNode());
  for (const char* key : {"encoder_node: 17, ", "encoder_serial: 4, "}) {
    try {
      loadEncoderAtDrive(key);
      FAIL();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("expected none: the drive reads this encoder (`drive_input`"),
                std::string::npos)
          << error.what();
    }
  }
}

/// Their PDOs need a longer period.
std::string withSwitches(const std::string& negative, const std::string& positive) {
  const std::string text =
      withReference(kEncoder + "\n      negative_switch_bit: " + negative + "\n      positive_switch_bit: " + positive);
  return replaced(text, "period_ms: 4", "period_ms: 5");
}

TEST(HardwareSwitches, HaveABitEach) {
  const Folder folder;
  const hal::AxisConfig axis = loadHardware(folder.write("file.yaml", withSwitches("1", "0"))).axes[0];
  EXPECT_EQ(axis.negative_switch, 1);
  EXPECT_EQ(axis.positive_switch, 0);
  EXPECT_FALSE(loadReference(kEncoder).axes[0].hasSwitches());
  try {
    loadHardware(folder.write("file.yaml", withSwitches("4", "4")));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.key(), "translations[0].drive.positive_switch_bit");
    EXPECT_NE(std::string(error.what()).find("expected one of its own"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tandem::config::test
