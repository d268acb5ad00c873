// SPDX-License-Identifier: Apache-2.0
/** @file Each injectable fault has a visible effect on the bus. */
#include "sim/drives/faults.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <stdexcept>

#include "tests/unit/support/drive_rig.h"

namespace tandem::sim::drives {
namespace {

using hal::canopen::NodeFailure;
using hal::canopen::NodePhase;
using test::DriveRig;
using test::kActual;
using test::kMillisecond;
using test::kTarget;

constexpr int kEncoder = 1;  // index in the network of a fixture with one drive
namespace error_code = hal::canopen::error_code;

struct Faults : testing::Test {
  DriveRig rig{1};
  void SetUp() override { ASSERT_TRUE(rig.ready()); }
  bool inject(FaultKind kind, std::uint8_t node = 1, double value = 0.0, double duration = 0.0) {
    return rig.drives.inject({kind, node, value, duration});
  }
  void ramp(double speed, double seconds) {
    double target = static_cast<double>(rig.command().layout.getSigned(rig.command().word, kTarget));
    for (double t = 0.0; t < seconds; t += 4e-3)
      rig.cycle([&] { rig.command().set(kTarget, std::llround(target += 4e-3 * speed)); });
  }
  std::uint16_t lastCode(int node = 0) { return rig.network.node(node).lastEmcy().code; }
  bool inFault() { return (rig.status() & 0x4F) == 0x08; }
};

TEST_F(Faults, Off) {
  ASSERT_TRUE(inject(FaultKind::kOff, 1, 0.0, 0.3));
  ASSERT_TRUE(rig.until([&] { return rig.network.anyFailed(); }, 1.0));
  EXPECT_EQ(rig.network.node(0).failure().reason, NodeFailure::Reason::kHeartbeatLost);
  EXPECT_FALSE(rig.drive().powered());
  rig.run(0.4);
  EXPECT_TRUE(rig.drive().powered()) << "it ends by itself";
  EXPECT_EQ(rig.drive().state(), DriveState::kSwitchOnDisabled);
}

TEST_F(Faults, EmergencyStopTakesTheTorqueAndKeepsIt) {
  ramp(100e3, 0.3);
  EXPECT_EQ(rig.read(0, {0x60FD, 0}) >> Drive::kEmergencyInput & 1u, 1u);
  ASSERT_TRUE(inject(FaultKind::kEmergencyStop, 0));
  EXPECT_FALSE(inject(FaultKind::kEmergencyStop, 17)) << "an encoder has no torque";
  rig.run(0.02);
  EXPECT_EQ(rig.drive().state(), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(rig.status() & 0x4010, 0x4000);
  EXPECT_EQ(rig.read(0, {0x60FD, 0}) >> Drive::kEmergencyInput & 1u, 0u);
  EXPECT_FALSE(rig.enable());
  EXPECT_EQ(rig.drives.clear(0, FaultKind::kEmergencyStop), 1);
  EXPECT_TRUE(rig.enable());
}

TEST_F(Faults, StuckRotor) {
  ASSERT_TRUE(inject(FaultKind::kStuck));
  ramp(100e3, 0.3);
  EXPECT_TRUE(inFault());
  EXPECT_EQ(lastCode(), error_code::kFollowingError);
  EXPECT_EQ(rig.drive().record().travel, 0.0);
}

TEST_F(Faults, StuckEncoder) {
  ASSERT_TRUE(inject(FaultKind::kStuck, 17));
  const auto before = rig.feedback(kEncoder).getSigned(0);
  ramp(100e3, 0.3);
  EXPECT_EQ(rig.feedback(kEncoder).getSigned(0), before);
  EXPECT_GT(rig.feedback().getSigned(kActual), 20'000);
}

TEST_F(Faults, Garbage) {
  ASSERT_TRUE(inject(FaultKind::kGarbage, 17));
  std::set<std::int64_t> values;
  for (int k = 0; k < 20; ++k, rig.cycle())
    values.insert(rig.feedback(kEncoder).getSigned(0));
  EXPECT_GT(values.size(), 15u);
}

TEST_F(Faults, Wrong) {
  const auto before = rig.feedback(kEncoder).getSigned(0);
  ASSERT_TRUE(inject(FaultKind::kWrong, 17, 321));
  rig.run(0.02);
  EXPECT_EQ(rig.feedback(kEncoder).getSigned(0), before + 321);
  EXPECT_EQ(rig.drives.clear(17, FaultKind::kWrong), 1);
  rig.run(0.02);
  EXPECT_EQ(rig.feedback(kEncoder).getSigned(0), before);
}

TEST_F(Faults, Slow) {
  ASSERT_TRUE(inject(FaultKind::kSlow));
  ramp(200e3, 0.3);
  EXPECT_TRUE(inFault());
  EXPECT_EQ(lastCode(), error_code::kFollowingError);
  EXPECT_GT(rig.drive().record().travel, 0.0);
}

TEST_F(Faults, Delayed) {
  ASSERT_TRUE(inject(FaultKind::kDelayed, 1, 12));
  rig.run(0.1);
  std::int64_t sync = 0, answer = 0;
  rig.command().set(test::kControl, 0x07);  // a change that is visible in the statusword
  std::uint16_t last = rig.status();
  for (int k = 0; k < 20 && answer == 0; ++k) {
    rig.cycle([&] { sync = sync == 0 ? rig.now : sync; });
    if (rig.status() != last)
      answer = rig.now;
  }
  EXPECT_GE(answer - sync, 12 * kMillisecond);
}

TEST_F(Faults, Intermittent) {
  ASSERT_TRUE(inject(FaultKind::kIntermittent, 17, 40));
  int silent = 0, received = 0;
  std::uint64_t last = rig.feedback(kEncoder).count;
  for (int k = 0; k < 100; ++k) {
    rig.cycle();
    (rig.feedback(kEncoder).count == last ? silent : received) += 1;
    last = rig.feedback(kEncoder).count;
  }
  EXPECT_GT(silent, 30);
  EXPECT_GT(received, 30);
}

TEST_F(Faults, OverCurrent) {
  ASSERT_TRUE(inject(FaultKind::kOverCurrent));
  ASSERT_TRUE(rig.until([&] { return inFault(); }, 0.5));
  EXPECT_EQ(lastCode(), error_code::kOverCurrent);
  EXPECT_EQ(rig.network.node(0).lastEmcy().error_register, 0x03);
  rig.command().set(test::kControl, 0x80);
  rig.run(0.05);
  EXPECT_TRUE(inFault()) << "the cause stands";
  rig.drives.clear(1, FaultKind::kOverCurrent);
  rig.command().set(test::kControl, 0x00);
  rig.run(0.05);
  rig.command().set(test::kControl, 0x80);
  rig.run(0.05);
  EXPECT_FALSE(inFault());
}

TEST_F(Faults, OverTemperature) {
  ASSERT_TRUE(inject(FaultKind::kOverTemperature));
  ASSERT_TRUE(rig.until([&] { return inFault(); }, 0.5));
  EXPECT_EQ(lastCode(), error_code::kDriveTemperature);
  EXPECT_GT(rig.read(0, {0x2001, 0}), 110u);
}

TEST_F(Faults, EncoderAlarm) {
  ASSERT_TRUE(inject(FaultKind::kEncoderAlarm, 17));
  rig.run(0.02);
  EXPECT_EQ(rig.feedback(kEncoder).get(1), 1u) << "object 6503";
  EXPECT_EQ(lastCode(kEncoder), error_code::kEncoder);
  rig.drives.clear(17, std::nullopt);
  rig.run(0.02);
  EXPECT_EQ(rig.feedback(kEncoder).get(1), 0u);
  EXPECT_EQ(lastCode(kEncoder), error_code::kNone) << "an emergency that tells the end";
  ASSERT_TRUE(inject(FaultKind::kEncoderAlarm, 1));
  ASSERT_TRUE(rig.until([&] { return inFault(); }, 0.5));
  EXPECT_EQ(lastCode(), error_code::kEncoder);
}

TEST_F(Faults, FrameLoss) {
  ASSERT_TRUE(inject(FaultKind::kFrameLoss, 0, 0.2));
  const auto before = rig.feedback(kEncoder).count;
  for (int k = 0; k < 200; ++k)
    rig.cycle();
  // Both SYNC and the answer must arrive.
  EXPECT_NEAR(static_cast<double>(rig.feedback(kEncoder).count - before), 200 * 0.64, 30.0);
  EXPECT_GT(rig.drives.record().lost, 50u);
}

TEST_F(Faults, ByteFlips) {
  ASSERT_TRUE(inject(FaultKind::kByteFlips, 17, 1.0));
  int wrong = 0;
  for (int k = 0; k < 50; ++k, rig.cycle())
    wrong += rig.feedback(kEncoder).getSigned(0) != 0 || rig.feedback(kEncoder).get(1) != 0;
  EXPECT_GT(wrong, 40);
  EXPECT_GT(rig.drives.record().flipped, 40u);
}

TEST_F(Faults, BusOff) {
  ASSERT_TRUE(inject(FaultKind::kBusOff, 0));
  rig.run(0.05);
  EXPECT_EQ(rig.master_port.state(), hal::can::BusState::kOff);
  EXPECT_TRUE(rig.master_port.faulty());
  rig.run(0.3);
  EXPECT_EQ(rig.drive().state(), DriveState::kSwitchOnDisabled) << "the drive stops by itself";
  EXPECT_TRUE(rig.network.anyFailed());
  rig.drives.clear(0, FaultKind::kBusOff);
  rig.run(0.1);
  EXPECT_EQ(rig.master_port.state(), hal::can::BusState::kActive);
  EXPECT_EQ(rig.master_port.counters().bus_off, 1u);
  EXPECT_TRUE(rig.network.anyFailed()) << "nothing comes back by itself";
  EXPECT_TRUE(rig.bringUp()) << "a full boot brings all back";
}

TEST_F(Faults, BabblingNode) {
  ASSERT_TRUE(inject(FaultKind::kBabbling, 1, 3000));
  const auto before = rig.network.counters().foreign;
  rig.run(1.0);
  EXPECT_NEAR(static_cast<double>(rig.network.counters().foreign - before), 3000.0, 100.0);
}

TEST_F(Faults, WhatCannotBeIsRefused) {
  EXPECT_FALSE(inject(FaultKind::kStuck, 99)) << "no such node";
  EXPECT_FALSE(inject(FaultKind::kOverCurrent, 17)) << "an encoder has no motor";
  EXPECT_FALSE(inject(FaultKind::kBusOff, 1));
  EXPECT_FALSE(inject(FaultKind::kStuck, 0));
  EXPECT_EQ(rig.drives.clear(1, std::nullopt), 0);
}

TEST(Encoder, FollowsItsAxisAndTakesAPreset) {
  auto spec = test::rigSpec(1);
  spec.encoders[0].ratio = -0.5;
  spec.encoders[0].offset = 700;
  DriveRig rig(spec);
  rig.network.addNode(test::driveSetup(1));
  rig.network.addNode(test::encoderSetup(17));
  ASSERT_TRUE(rig.ready());
  EXPECT_EQ(rig.feedback(1).getSigned(0), 700);
  rig.command().set(kTarget, 1000);
  rig.run(0.5);
  EXPECT_NEAR(static_cast<double>(rig.feedback(1).getSigned(0)), 200.0, 1.0);
  EXPECT_EQ(rig.write(1, {0x6003, 0}, 5000, 4), hal::canopen::SdoAbort::kNone);
  rig.run(0.02);
  EXPECT_NEAR(static_cast<double>(rig.feedback(1).getSigned(0)), 5000.0, 1.0);
  EXPECT_NEAR(static_cast<double>(static_cast<std::int32_t>(rig.read(1, {0x6509, 0}))), 4800.0, 1.0) << "offset";
  EXPECT_EQ(rig.read(1, {0x650B, 0}), test::kRigSerial + 17);
  EXPECT_EQ(rig.write(1, {0x6200, 0}, 12, 2), hal::canopen::SdoAbort::kNone);
  EXPECT_EQ(rig.read(1, {0x1800, 5}), 12u) << "the cyclic timer is that of TPDO 1";
  EXPECT_EQ(rig.write(1, {0x6000, 0}, 4, 2), hal::canopen::SdoAbort::kValueRange) << "no scaling";
}

TEST(DriveBus, RefusesABadSpecification) {
  hal::can::VirtualBus wire;
  auto& port = wire.join("drives");
  auto twice = test::rigSpec(2);
  twice.drives[1].id = 1;
  EXPECT_THROW(DriveBus(port, twice, 0), std::invalid_argument);
  auto lonely = test::rigSpec(1);
  lonely.encoders[0].drive = 9;
  EXPECT_THROW(DriveBus(port, lonely, 0), std::invalid_argument);
  auto wrong = test::rigSpec(1);
  for (EdsObject& object : wrong.drive_eds.objects) {
    if (object.address.index == 0x6085)
      object.type = DataType::kVisibleString;
  }
  EXPECT_THROW(DriveBus(port, wrong, 0), std::invalid_argument);
}

TEST(FaultCommand, ReadsWhatItDocuments) {
  const FaultCommand inject = parseFaultCommand("inject 3 wrong 250 for 1.5");
  EXPECT_EQ(inject.kind, FaultCommand::Kind::kInject);
  EXPECT_EQ(inject.injection.node, 3);
  EXPECT_EQ(inject.injection.kind, FaultKind::kWrong);
  EXPECT_EQ(inject.injection.value, 250.0);
  EXPECT_EQ(inject.injection.duration, 1.5);
  for (int k = 0; k < kFaultKinds; ++k) {
    const auto kind = static_cast<FaultKind>(k);
    EXPECT_EQ(parseFaultCommand("inject 1 " + std::string(name(kind))).injection.kind, kind);
  }
  EXPECT_EQ(parseFaultCommand("clear 0").fault, std::nullopt);
  EXPECT_EQ(parseFaultCommand("clear 4 stuck").fault, FaultKind::kStuck);
  EXPECT_EQ(parseFaultCommand("mark").kind, FaultCommand::Kind::kMark);
  for (const char* line : {"inject 1 off for 1e300", "inject 1 delayed 2e9", "inject 1 delayed nan", "inject 128 off",
                           "", "break 1", "inject", "inject x stuck", "inject 128 stuck", "inject 1", "inject 1 tired",
                           "inject 1 stuck for", "inject 1 stuck for -1", "inject 1 wrong 3x", "clear", "state 1"}) {
    EXPECT_THROW(parseFaultCommand(line), std::invalid_argument) << line;
  }
}

}  // namespace
}  // namespace tandem::sim::drives
