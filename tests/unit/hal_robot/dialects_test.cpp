// SPDX-License-Identifier: Apache-2.0
/** @file Drives that differ in units, modes, answers and objects, within the standards: each boots, moves and stops. */
#include "hal/canopen/cob.h"
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

using sim::drives::AnswerForm;
using sim::drives::Eds;
using sim::drives::EdsObject;
using sim::drives::Habits;

/// The drives' data sheet with this object changed or added, read-only.
Eds stating(std::initializer_list<std::pair<canopen::ObjectAddress, std::int64_t>> values) {
  Eds eds = sim::drives::driveEds();
  for (const auto& entry : values) {
    EdsObject object;
    object.address = entry.first;
    object.name = canopen::describe(entry.first);
    object.value = entry.second;
    std::erase_if(eds.objects, [&](const EdsObject& other) { return other.address == object.address; });
    eds.objects.push_back(object);
  }
  std::ranges::sort(eds.objects, {}, &EdsObject::address);
  return eds;
}

Eds without(std::initializer_list<std::uint16_t> indices) {
  Eds eds = sim::drives::driveEds();
  for (const std::uint16_t index : indices)
    EXPECT_GT(std::erase_if(eds.objects, [&](const auto& o) { return o.address.index == index; }), 0u);
  return eds;
}

/// Drives that take one object in a PDO; `torque`: the feedback has one more.
HardwareConfig withSingleObjects(DriveMode mode, bool torque) {
  HardwareConfig config = presetHardware(mode);
  for (AxisConfig& axis : config.axes) {
    axis.pdo_objects = 1;
    axis.torque.object = torque ? 0x6077 : 0;
  }
  return config;
}

Eds takingOneObject() {
  Eds eds = sim::drives::driveEds();
  for (EdsObject& object : eds.objects) {
    const int kind = object.address.index & 0xFFFC;
    if ((kind == 0x1600 || kind == 0x1A00) && object.address.sub == 0) {
      object.high = 1;
      object.value = std::min<std::int64_t>(object.value, 1);
    }
  }
  return eds;
}

HardwareConfig inUnits(DriveMode mode, const DriveUnits& units) {
  HardwareConfig config = presetHardware(mode);
  for (AxisConfig& axis : config.axes)
    axis.units = units;
  return config;
}

/** A robot of such drives boots, moves by its commands, stands, and stops with the ramp of its drives. */
void expectMovesAndStops(System& system) {
  constexpr double kTranslation = 4e-3, kRotation = 0.3;
  ASSERT_TRUE(system.boot()) << system.story() << driveNode(system.robot->arm(0).axis(0)).describeFailure();
  ASSERT_TRUE(system.enable()) << system.story();
  const ArmVector start = system.truth(0);
  system.run(0.3);
  EXPECT_LE((system.truth(0) - start).head(3).cwiseAbs().maxCoeff(), 5e-6) << "stands, m";
  expectMoves(system, kTranslation, kRotation);
  EXPECT_LE((system.truth(0) - system.robot->setpoint(0)).head(3).cwiseAbs().maxCoeff(), 20e-6) << "m";
  system.move(0, speeds(kTranslation, kRotation));
  system.run(0.5);
  system.hal_alive = false;
  const ArmVector before = system.truth(0);
  system.run(0.1 + 0.3);
  const AxisConfig& axis = system.config.axes[0];
  const double allowed = kTranslation * (0.1 + 0.02 + 1.0 / axis.velocity_gain) +
                         kTranslation * kTranslation / axis.quick_stop_deceleration;
  EXPECT_LE((system.truth(0) - before).head(3).cwiseAbs().maxCoeff(), allowed);
  const ArmVector stood = system.truth(0);
  system.run(0.5);
  EXPECT_LE((system.truth(0) - stood).cwiseAbs().maxCoeff(), 1e-6);
}

struct Dialect {
  const char* name;
  HardwareConfig config;
  DriveKind kind;
};
std::ostream& operator<<(std::ostream& out, const Dialect& dialect) { return out << dialect.name; }

/// rpm and rpm/s, and revolutions and 1/s^2, as the drives state them; numbers of CiA 303-2.
constexpr std::int64_t kRpm = 0x00B44700, kRpmPerSecond = 0x00C00300, kMilliRpm = 0xFDB44700, kPerSecond2 = 0x00B45700;
const DriveUnits kRpmUnits{RateUnit::kRevolutionsPerMinute, RateUnit::kRevolutionsPerMinute, 1.0, 1.0};
const DriveUnits kMilliRpmUnits{RateUnit::kRevolutionsPerMinute, RateUnit::kRevolutionsPerSecond, 1000.0, 1.0};

std::vector<Dialect> dialects() {
  using enum DriveMode;
  const Eds rpm = stating({{{0x60A9, 0}, kRpm}, {{0x60AA, 0}, kRpmPerSecond}});
  const Eds milli_rpm = stating({{{0x60A9, 0}, kMilliRpm}, {{0x60AA, 0}, kPerSecond2}});
  HardwareConfig silent = presetHardware();
  for (AxisConfig& axis : silent.axes)
    axis.reports_following = false;
  HardwareConfig slow = presetHardware();
  for (AxisConfig& axis : slow.axes)
    axis.sdo_timeout = 0.5;
  return {
      {"ProfileVelocity", presetHardware(kProfileVelocity), {}},
      {"RpmInPositionMode", inUnits(kCyclicPosition, kRpmUnits), rpm},
      {"RpmInVelocityMode", inUnits(kCyclicVelocity, kRpmUnits), rpm},
      {"RpmInProfileVelocity", inUnits(kProfileVelocity, kRpmUnits), rpm},
      {"MilliRpmInProfileVelocity", inUnits(kProfileVelocity, kMilliRpmUnits), milli_rpm},
      {"UnitsThatAreNotStated", inUnits(kProfileVelocity, kMilliRpmUnits), {}},
      {"AnswersWithoutSize", presetHardware(), {sim::drives::driveEds(), {AnswerForm::kUnsized}}},
      {"AnswersOfFourBytes", presetHardware(), {sim::drives::driveEds(), {AnswerForm::kFourBytes}}},
      {"AModeThatShowsInOperation", presetHardware(), {sim::drives::driveEds(), {AnswerForm::kSized, 0, true}}},
      {"SlowAnswers", slow, {sim::drives::driveEds(), {AnswerForm::kSized, 30 * kMillisecond}}},
      {"RoundedRates", presetHardware(kProfileVelocity), {sim::drives::driveEds(), {AnswerForm::kSized, 0, false, 7}}},
      {"NoBitForFollowing", silent, {}},
      {"OneObjectPerPdo", withSingleObjects(kCyclicPosition, false), takingOneObject()},
      {"OneObjectPerPdoWithTorque", withSingleObjects(kCyclicVelocity, true), takingOneObject()},
      {"OneObjectPerPdoInProfileVelocity", withSingleObjects(kProfileVelocity, true), takingOneObject()},
      {"NoSoftwareLimits", presetHardware(), without({0x607D})},
      {"NoSpeedLimitAndNoModes", presetHardware(), without({0x6080, 0x6502})}};
}

class EachDialect : public testing::TestWithParam<Dialect> {};

TEST_P(EachDialect, MovesAndStops) {
  System system(GetParam().config, 0.0, GetParam().kind);
  expectMovesAndStops(system);
}

INSTANTIATE_TEST_SUITE_P(Of, EachDialect, testing::ValuesIn(dialects()), [](const auto& i) { return i.param.name; });

TEST(Dialects, ADriveWithoutTheModeIsRefusedWithItsName) {
  DriveKind kind;
  std::ranges::find(kind.eds.objects, canopen::ObjectAddress{0x6502, 0}, &canopen::EdsObject::address)->value = 0x65;
  System system(presetHardware(), 0.0, kind);
  EXPECT_FALSE(system.boot());
  EXPECT_NE(driveNode(system.robot->arm(0).axis(0))
                .describeFailure()
                .find("supported modes, among them cyclic synchronous position 6502:00: found 101 (0x65), "
                      "expected 128 (0x80) in the bits 128 (0x80)"),
            std::string::npos)
      << driveNode(system.robot->arm(0).axis(0)).describeFailure();
}

TEST(Dialects, ADriveThatTakesOneObjectRefusesTwo) {
  System system(presetHardware(), 0.0, takingOneObject());
  EXPECT_FALSE(system.boot());
  EXPECT_NE(driveNode(system.robot->arm(0).axis(0)).describeFailure().find("RPDO 1"), std::string::npos);
}

/// The position comes in a frame of its own: without it the statusword alone is no feedback.
TEST(Dialects, EachPdoOfTheFeedbackCounts) {
  for (const std::uint8_t pdo : {0, 1, 2}) {
    SCOPED_TRACE(int{pdo});
    System system(withSingleObjects(DriveMode::kCyclicPosition, true), 0.0, takingOneObject());
    ASSERT_TRUE(system.boot() && system.enable()) << system.story();
    system.run(0.2);
    EXPECT_EQ(system.robot->arm(0).axis(1).feedbackSuccess(), 1.0);
    ASSERT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
    // Bit 31 of 1800+n:01 switches a PDO off.
    can::CanFrame off;
    off.id = canopen::cob::kSdoRequest + 2;
    off.length = 8;
    off.data = {0x23, pdo, 0x18, 0x01, static_cast<std::uint8_t>(0x82), static_cast<std::uint8_t>(0x01 + pdo), 0, 0x80};
    system.wires[0]->bus.join("tool").send({&off, 1});
    ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
    EXPECT_GT(system.guardCount(HardwareGuard::kDriveSilent), 0u) << system.story();
  }
}

/// What the HAL says of the failed drive of an axis.
std::string failureOf(const Axis& axis) {
  return axis.driver().describe(deviceFailure(driveNode(axis).failure()), false);
}

/// Without an encoder nothing else can tell that every distance is wrong.
TEST(Dialects, ADriveThatStatesOtherCountsIsRefused) {
  HardwareConfig hardware = presetHardware();
  const double counts = hardware.axes[0].gearing.counts_per_revolution;
  const auto states = [](double value) {
    return stating({{{0x608F, 1}, std::llround(value)}, {{0x6092, 1}, std::llround(value)}});
  };
  for (const double factor : {0.5, 0.9, 1.1, 4.0, 400.0}) {
    System system(hardware, 0.0, states(factor * counts));
    EXPECT_FALSE(system.boot()) << factor;
    const std::string text = failureOf(system.robot->arm(0).axis(0));
    EXPECT_EQ(text.find("the drive states " + std::to_string(std::llround(factor * counts)) + " counts"), 0u) << text;
    EXPECT_NE(text.find("correct counts_per_revolution"), std::string::npos) << text;
    system.request(DriveRequest::kEnable);
    system.run(1.0);
    EXPECT_TRUE(system.robot->off());
  }
  System same(hardware, 0.0, states(counts));
  EXPECT_TRUE(same.boot()) << same.story();
  for (AxisConfig& axis : hardware.axes)
    axis.checks_counts = false;
  System ignored(hardware, 0.0, states(2.0 * counts));
  EXPECT_TRUE(ignored.boot()) << ignored.story();
  EXPECT_NE(ignored.robot->arm(0).axis(0).driver().remarks(), "");
}

/// Objects that no protection rests on: a drive that keeps values of its own there works as well.
TEST(Dialects, ADriveThatRefusesADispensableValueBoots) {
  Eds eds = sim::drives::driveEds();
  int limited = 0;
  for (EdsObject& object : eds.objects) {
    const int index = object.address.index;
    if (index == 0x6084 || (index >= 0x605B && index <= 0x605D)) {
      object.low = object.high = object.value = 5;
      ++limited;
    }
  }
  ASSERT_EQ(limited, 4);
  System system(presetHardware(), 0.0, eds);
  expectMovesAndStops(system);
  EXPECT_EQ(system.robot->arm(0).axis(0).driver().lostProtections(), 0u);
}

/// A wrong unit is a wrong speed: the drive's own statement counts.
TEST(Dialects, ADriveThatStatesAnotherUnitIsRefused) {
  System system(presetHardware(), 0.0, stating({{{0x60A9, 0}, kRpm}}));
  EXPECT_FALSE(system.boot());
  EXPECT_EQ(failureOf(system.robot->arm(0).axis(0)),
            "the drive states velocities (60A9) in rpm, the hardware file says counts_per_s: set velocity_unit and its "
            "_scale, or set up the drive");
  system.request(DriveRequest::kEnable);
  system.run(1.0);
  EXPECT_TRUE(system.robot->off());
  System thousandths(inUnits(DriveMode::kCyclicVelocity, kMilliRpmUnits), 0.0, stating({{{0x60A9, 0}, kRpm}}));
  EXPECT_FALSE(thousandths.boot());
}

TEST(Dialects, AUnitThatIsNotKnownSaysNothing) {
  System system(presetHardware(), 0.0, stating({{{0x60A9, 0}, 0x00010000}, {{0x60AA, 0}, 0}}));
  EXPECT_TRUE(system.boot()) << system.story();
}

TEST(Dialects, ADriveThatAnswersAfterTheTimeOutIsRefused) {
  System system(presetHardware(), 0.0, {sim::drives::driveEds(), {AnswerForm::kSized, 150 * kMillisecond}});
  EXPECT_FALSE(system.boot());
  EXPECT_EQ(driveNode(system.robot->arm(0).axis(0)).failure().abort, canopen::SdoAbort::kTimeout);
}

/// The mode that the drive shows in operation is another one: no motion.
TEST(Dialects, AWrongModeGivesNoMotion) {
  System system(presetHardware(), 0.0, {sim::drives::driveEds(), {AnswerForm::kSized, 0, true}});
  ASSERT_TRUE(system.boot()) << system.story();
  system.drive(0, 0).dictionary().require(0x6060).value = sim::drives::kCyclicVelocity;
  const ArmVector before = system.truth(0);
  system.move(0, speeds(4e-3, 0.3));
  EXPECT_FALSE(system.enable());
  EXPECT_NE(system.robot->state(0), OperatingState::kEnabled);
  EXPECT_LE((system.truth(0) - before).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT(system.guardCount(HardwareGuard::kSwitchOn), 0u);
}

/// Both arms on one bus; arm A moves while the nodes of arm B boot.
TEST(Dialects, TheSetupOfOneArmLeavesTheBusToTheOther) {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    axis.node += axis.bus == 0 ? 0 : 6;
    axis.encoder->node = 32 + axis.node;
    axis.bus = 0;
  }
  config.buses.resize(1);
  config.period = 8e-3;
  config.emergency_stop.clear();
  System system(config);
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  can::VirtualBus::Port& listener = system.wires[0]->bus.join("listener");
  ASSERT_TRUE(system.inject(0, FaultKind::kOverCurrent, 7, 0.0, 0.1));
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(1) == OperatingState::kFault; }));
  system.run(2.5);
  system.move(0, speeds(1e-3, 0.05));
  const auto interval = static_cast<int>(
      std::lround(config.trafficOf(0, safety::Budgets{}.drive_heartbeat).request_interval / config.period));
  EXPECT_LE(interval, kLongestRequestInterval);
  system.command.request[1] = DriveRequest::kDisable;
  int since = interval, requests = 0, shortest = interval;
  system.after_period = [&] {
    std::array<can::CanFrame, 256> frames;
    int here = 0;
    for (std::size_t k = 0, count = listener.receive(frames); k < count; ++k)
      here += frames[k].id > canopen::cob::kSdoRequest && frames[k].id <= canopen::cob::kSdoRequest + 127 ? 1 : 0;
    ++since;
    requests += here;
    EXPECT_LE(here, 1);
    if (here > 0) {
      shortest = std::min(shortest, since);
      since = 0;
    }
  };
  EXPECT_TRUE(system.until(120.0, [&] { return system.robot->state(1) == OperatingState::kDisabled; }))
      << system.story();
  EXPECT_GT(requests, 500);
  EXPECT_GE(shortest, interval);
  EXPECT_EQ(system.robot->state(0), OperatingState::kEnabled) << system.story();
}

/// The drives' data sheet with one more object, a 32-bit number that may be written.
Eds withParameter(canopen::ObjectAddress address, std::int64_t value) {
  Eds eds = stating({{address, value}});
  std::ranges::find(eds.objects, address, &EdsObject::address)->access = canopen::Access::kReadWrite;
  return eds;
}

SdoWrite writing(canopen::ObjectAddress object, std::int64_t value, bool optional = false) {
  SdoWrite write;
  write.index = object.index;
  write.sub = object.sub;
  write.value = value;
  write.optional = optional;
  write.why = "a current limit";
  return write;
}

TEST(WritesOfTheFile, ComeBeforeThoseOfTheHal) {
  HardwareConfig hardware = presetHardware();
  hardware.axes[0].sdo = {writing({0x3001, 2}, 4711), writing({0x6085, 0}, 1)};
  System system(hardware, 0.0, withParameter({0x3001, 2}, 0));
  ASSERT_TRUE(system.boot()) << system.story() << driveNode(system.robot->arm(0).axis(0)).describeFailure();
  EXPECT_EQ(system.drive(0, 0).dictionary().require(0x3001, 2).value, 4711);
  EXPECT_EQ(system.drive(0, 1).dictionary().require(0x3001, 2).value, 0) << "of one axis";
  const AxisConfig& axis = hardware.axes[0];
  EXPECT_EQ(system.drive(0, 0).dictionary().require(0x6085, 0).value,
            std::abs(AxisUnits(axis.gearing, axis.units).toAccelerationNumber(axis.quick_stop_deceleration)))
      << "no write replaces a protection";
}

TEST(WritesOfTheFile, AnAbsentObjectStopsTheBootUnlessItIsOptional) {
  HardwareConfig hardware = presetHardware();
  hardware.axes[0].sdo = {writing({0x3001, 2}, 4711, true)};
  System tolerant(hardware);
  EXPECT_TRUE(tolerant.boot());
  hardware.axes[0].sdo[0].optional = false;
  System strict(hardware);
  strict.robot->start(strict.now);
  const canopen::Node& node = driveNode(strict.robot->arm(0).axis(0));
  ASSERT_TRUE(strict.until(3.0, [&] { return node.phase() == canopen::NodePhase::kFailed; }));
  EXPECT_NE(node.describeFailure().find("a current limit 3001:02"), std::string::npos) << node.describeFailure();
}

/// Drives round: what is read back may differ by as much as the file says, in either direction.
TEST(WritesOfTheFile, AreReadBackWithTheirTolerance) {
  for (const int size : {1, 2, 4}) {
    for (const std::int64_t value : {std::int64_t{-40}, std::int64_t{0}, std::int64_t{100}}) {
      canopen::SetupStep step = canopen::write({0x3001, 2}, value, size, "x");
      for (const std::int64_t error : {-6, -5, -1, 0, 1, 5, 6}) {
        const std::uint64_t read = canopen::write({0x3001, 2}, value + error, size, "x").value;
        step.tolerance = 5;
        EXPECT_EQ(step.passes(read), std::abs(error) <= 5) << size << " " << value << " " << error;
        step.tolerance = 0;
        EXPECT_EQ(step.passes(read), error == 0);
      }
    }
  }
}

TEST(StatedFactors, AreReadWhereADriveHasThem) {
  HardwareConfig hardware = presetHardware();
  for (AxisConfig& axis : hardware.axes)
    axis.checks_counts = false;
  const auto stated = [&](const DriveKind& kind) {
    System system(hardware, 0.0, kind);
    EXPECT_TRUE(system.boot());
    return statedFactors(driveNode(system.robot->arm(0).axis(0)));
  };
  EXPECT_FALSE(statedCounts(stated(without({0x608F, 0x6091, 0x6092}))));
  const StatedFactors all = stated(
      stating({{{0x608F, 1}, 8000}, {{0x6091, 1}, 3}, {{0x6092, 1}, 36000}, {{0x6096, 1}, 60}, {{0x6096, 2}, 4096}}));
  EXPECT_EQ(statedCounts(all), 12000.0) << "position units of the shaft count, not the encoder's increments";
  EXPECT_TRUE(all.velocity.isSet());
  EXPECT_EQ(all.velocity.value(), 60.0 / 4096.0);
  EXPECT_FALSE(all.acceleration.isSet());
  EXPECT_EQ(stated(stating({{{0x6097, 1}, 1}, {{0x6097, 2}, 4096}})).acceleration.value(), 1.0 / 4096.0);
  // 1:1 is what drives have that leave it to others.
  EXPECT_EQ(statedCounts(stated(stating({{{0x6092, 1}, 1}, {{0x608F, 1}, 500}}))), 500.0);
}

}  // namespace
}  // namespace tandem::hal::test
