// SPDX-License-Identifier: Apache-2.0
/** @file Absolute positions after a restart: the HAL ends at random instants, joints are turned by hand meanwhile, and
 * the file of last positions is damaged. */
#include "hal/position_file.h"

#include <unistd.h>

#include <fstream>
#include <sstream>

#include "robot_fixture.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::test {
namespace {

using tandem::test::Random;
constexpr double kTolerance = 0.5e-3, kRotationTolerance = 0.02;

HardwareConfig rememberingHardware() {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes)
    axis.jump_tolerance = axis.translation ? kTolerance : kRotationTolerance;
  return config;
}

/** A robot whose HAL can end and start again, with its file. */
class Restartable : public System {
 public:
  Restartable() : System(rememberingHardware()), file_(folder() / "positions" / "robot.txt") {
    std::filesystem::remove_all(folder());
  }
  ~Restartable() { std::filesystem::remove_all(folder()); }

  void save() { writePositions(file_, config, robot->lastPositions()); }
  /// The HAL ends as if killed, and nobody commands; a new one reads the file and boots.
  void restart() {
    hal_alive = false;
    run(1.0);
    turnJoints();
    replaceHal(config);
    stored = readPositions(file_, config);
    for (std::size_t i = 0; i < stored.axes.size(); ++i)
      robot->restorePosition(i, stored.axes[i].state, stored.axes[i].position);
    hold();
    request(DriveRequest::kKeep);
    sequence += 1000;
    events.clear();
    hal_alive = true;
    robot->start(now);
    run(3.0);
  }
  /// Moves the motor of joint 0 of arm A without the HAL, m.
  void turn(double distance) { turn_ = distance; }
  /// Repeats the request of somebody who insists.
  bool confirm(double seconds = 4.0) {
    for (double t = 0.0; t < seconds && !allHomed(); t += 0.2) {
      for (int a = 0; a < robot->armCount(); ++a)
        robot->home(a, now);
      run(0.2);
    }
    return allHomed();
  }
  const std::filesystem::path& file() const { return file_; }
  std::string text() const {
    std::ifstream in(file_, std::ios::binary);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }
  void overwrite(const std::string& text) const { std::ofstream(file_, std::ios::binary) << text; }
  bool unconfirmed(int joint) const { return robot->arm(0).axis(joint).unconfirmed(); }
  bool ready(int joint) const { return robot->arm(0).axis(joint).phase() == AxisPhase::kReady; }

  StoredPositions stored;

 private:
  static std::filesystem::path folder() {
    return std::filesystem::path(testing::TempDir()) / ("tandem-positions-" + std::to_string(getpid()));
  }
  void turnJoints() {
    drive(0, 0).motor().turn(turn_ / AxisUnits(config.axes[0].gearing).scale());
    turn_ = 0.0;
    hal_alive = false;
    run(0.1);
  }

  std::filesystem::path file_;
  double turn_ = 0.0;
};

TEST(LastPositions, AFirstStartAsksForConfirmation) {
  Restartable system;
  system.robot->start(system.now);
  system.run(3.0);
  EXPECT_FALSE(system.allHomed());
  EXPECT_TRUE(system.unconfirmed(0));
  const auto reports = std::ranges::count(system.events, HardwareEvent::Kind::kUnconfirmed, &HardwareEvent::kind);
  EXPECT_EQ(reports, 12) << "each axis once";
  EXPECT_FALSE(system.enable()) << "not before somebody has confirmed";
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
  EXPECT_EQ(system.robot->home(0, system.now), ArmHardware::HomingAnswer::kUnconfirmed);
  system.request(DriveRequest::kKeep);
  system.run(1.2);
  EXPECT_FALSE(system.confirm(2.8)) << "not by a short request";
  system.run(1.2);
  EXPECT_FALSE(system.confirm(2.8)) << "nor by two of them";
  ASSERT_TRUE(system.confirm());
  ASSERT_TRUE(system.enable()) << system.story();
}

TEST(LastPositions, ATurnByHandAfterAnEndAtAnyTimeIsDetected) {
  Restartable system;
  system.robot->start(system.now);
  system.run(3.0);
  ASSERT_TRUE(system.confirm());
  int plausible = 0, asked = 0;
  for (std::uint32_t seed = tandem::test::baseSeed(); seed < tandem::test::baseSeed() + 12; ++seed) {
    SCOPED_TRACE(tandem::test::trace(seed));
    Random random(seed);
    if (random.chance(0.7)) {
      ASSERT_TRUE(system.enable()) << system.story();
      system.move(0, speeds(random.chance(0.5) ? 1e-3 : -1e-3, 0.0));
    }
    system.save();
    system.run(random.uniform(0.0, 1.0));  // the file is as old as it can be
    system.turn(random.chance(0.5) ? 0.0 : random.uniform(-2.0, 2.0) * kTolerance);
    system.restart();
    ASSERT_EQ(system.stored.problem, "");
    ASSERT_EQ(system.stored.axes[0].state, LastPosition::kKnown);
    const double jump = std::abs(system.truth(0, 0) - system.stored.axes[0].position);
    if (std::abs(jump - kTolerance) < 2e-6)
      continue;  // within the counts
    EXPECT_EQ(system.ready(0), jump <= kTolerance) << jump;
    EXPECT_EQ(system.unconfirmed(0), jump > kTolerance) << jump;
    if (jump <= kTolerance) {
      ++plausible;
    } else {
      ++asked;
      EXPECT_FALSE(system.enable());
      system.save();
      EXPECT_EQ(readPositions(system.file(), system.config).axes[0].position, system.stored.axes[0].position)
          << "an unconfirmed position is not stored";
      system.request(DriveRequest::kKeep);
      system.run(0.5);
    }
    ASSERT_TRUE(system.confirm()) << system.story();
    ASSERT_TRUE(system.allHomed());
  }
  EXPECT_GT(plausible, 0);
  EXPECT_GT(asked, 0);
}

TEST(LastPositions, ADamagedFileIsNeverUsed) {
  Restartable system;
  system.robot->start(system.now);
  system.run(3.0);
  ASSERT_TRUE(system.confirm());
  system.save();
  const std::string good = system.text();
  const StoredPositions right = readPositions(system.file(), system.config);
  for (std::size_t i = 0; i < right.axes.size(); ++i) {
    EXPECT_EQ(right.axes[i].state, LastPosition::kKnown);
    EXPECT_NEAR(right.axes[i].position, system.robot->lastPositions().axes[i].position, 0.0);
  }
  const auto refused = [&](const std::string& text) {
    system.overwrite(text);
    const StoredPositions stored = readPositions(system.file(), system.config);
    EXPECT_NE(stored.problem.find(system.file().string() + ":"), std::string::npos) << stored.problem;
    EXPECT_NE(stored.problem.find("expected"), std::string::npos) << stored.problem;
    for (const StoredPositions::One& one : stored.axes)
      EXPECT_EQ(one.state, LastPosition::kDamaged);
  };
  for (std::size_t size = 0; size < good.size(); ++size)
    refused(good.substr(0, size));
  Random random(tandem::test::baseSeed());
  for (int k = 0; k < 500; ++k) {
    std::string text = good;
    char& byte = text[static_cast<std::size_t>(random.integer(0, static_cast<int>(text.size()) - 1))];
    byte = static_cast<char>(byte ^ (1 << random.integer(0, 7)));
    refused(text);
  }
  // A HAL that starts with such a file asks.
  system.overwrite(good.substr(0, good.size() / 2));
  system.restart();
  EXPECT_TRUE(system.unconfirmed(0));
  const auto event = std::ranges::find(system.events, HardwareEvent::Kind::kUnconfirmed, &HardwareEvent::kind);
  ASSERT_NE(event, system.events.end());
  EXPECT_EQ(event->memory.state(), LastPosition::kDamaged);
  EXPECT_TRUE(system.confirm());
  EXPECT_TRUE(system.allHomed());
}

TEST(LastPositions, AreOfTheConversionThatStoredThem) {
  Restartable system;
  system.robot->start(system.now);
  system.run(3.0);
  ASSERT_TRUE(system.confirm());
  system.save();
  const AxisConfig& axis = system.config.axes[0];
  const std::function<void(AxisConfig&)> changes[] = {
      [](AxisConfig& a) { a.gearing.counts_per_revolution *= 2.0; },
      [](AxisConfig& a) { a.gearing.gear_ratio *= 1.0001; },
      [](AxisConfig& a) { a.gearing.travel_per_revolution *= 2.0; },
      [](AxisConfig& a) { a.gearing.offset += 1e-6; },
      [](AxisConfig& a) { a.gearing.reversed = !a.gearing.reversed; },
      [](AxisConfig& a) { a.encoder->gearing.offset += 1e-6; },
      [](AxisConfig& a) { a.encoder->gearing.reversed = !a.encoder->gearing.reversed; },
      [](AxisConfig& a) { a.encoder->gearing.counts_per_revolution += 1.0; },
      [](AxisConfig& a) { a.encoder->drive_input = 1; },
      [](AxisConfig& a) { a.encoder->range = 65536.0; },
      [](AxisConfig& a) { a.encoder.reset(); },
      [](AxisConfig& a) { a.identity.serial += 1; },
      [](AxisConfig& a) { a.reference = PositionReference::kDrive; }};
  for (const auto& change : changes) {
    HardwareConfig other = system.config;
    change(other.axes[0]);
    EXPECT_NE(conversionRevision(other.axes[0]), conversionRevision(axis));
    const StoredPositions stored = readPositions(system.file(), other);
    EXPECT_EQ(stored.axes[0].state, LastPosition::kChanged);
    EXPECT_EQ(stored.axes[1].state, LastPosition::kKnown);
  }
  HardwareConfig other = system.config;
  other.axes[0].velocity *= 2.0;  // converts nothing
  EXPECT_EQ(readPositions(system.file(), other).axes[0].state, LastPosition::kKnown);
  other.axes[0].name = "another axis";
  EXPECT_EQ(readPositions(system.file(), other).axes[0].state, LastPosition::kMissing);
}

TEST(LastPositions, AJumpWhileTheDriveWasOffIsNoticedWithoutARestart) {
  Restartable system;
  system.robot->start(system.now);
  system.run(3.0);
  ASSERT_TRUE(system.confirm());
  ASSERT_TRUE(system.enable()) << system.story();
  const int drive = system.config.axes[0].node, encoder = system.config.axes[0].encoder->node;
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, drive, 0.0, 0.5));
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, encoder, 0.0, 0.5));
  system.run(0.3);
  system.drive(0, 0).motor().turn(3.0 * kTolerance / AxisUnits(system.config.axes[0].gearing).scale());
  system.run(1.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  system.request(DriveRequest::kDisable);
  ASSERT_TRUE(system.until(10.0, [&] { return system.robot->state(0) == OperatingState::kDisabled; }))
      << system.story();
  EXPECT_TRUE(system.unconfirmed(0));
  EXPECT_TRUE(system.ready(1));
  EXPECT_FALSE(system.robot->homed(0));
}

}  // namespace
}  // namespace tandem::hal::test
