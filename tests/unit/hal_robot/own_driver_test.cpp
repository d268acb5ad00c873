// SPDX-License-Identifier: Apache-2.0
/** @file The library of docs/own-hardware.md: drives of another kind below the same axes, arms and guards. */
#include "my_board.cpp"  // from the page NOLINT(bugprone-suspicious-include)
#include "robot_fixture.h"
#include "services/hal/bus_setup.h"
#include "services/hal/hal_events.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::hal::test {
namespace {

/// The preset's axes on one bus behind a library, without encoders: the drives know where they are.
HardwareConfig boardHardware(DriveMode mode, const std::string& library = "unused") {
  System with_encoders;
  EXPECT_TRUE(with_encoders.boot());
  HardwareConfig config = presetHardware(mode);
  config.buses.resize(1);
  config.buses[0].address = "library:" + library;
  for (AxisConfig& axis : config.axes) {
    axis.bus = 0;
    axis.gearing.offset = with_encoders.truth(axis.arm, axis.joint);
    axis.encoder.reset();
    axis.reference = PositionReference::kDrive;
    axis.accepted = {{Protection::kCommandDeadline, "a test"}};
  }
  return config;
}

/** Two arms on the board. */
class Board : public System {
 public:
  explicit Board(DriveMode mode = DriveMode::kCyclicPosition) : Board(boardHardware(mode)) {}
  explicit Board(const HardwareConfig& hardware) : Board(hardware, new MyBus(hardware.period)) {}

  MyDriver& channel(int arm, int joint) { return bus_.driver(indexOf(arm, joint)); }
  static std::size_t indexOf(int arm, int joint) {
    const int index = 6 * arm + joint;
    return static_cast<std::size_t>(index);
  }
  /// By the motor, m or rad.
  double place(int arm, int joint) {
    const AxisConfig& axis = config.axes[indexOf(arm, joint)];
    return axis.gearing.offset + AxisUnits(axis.gearing).scale() * channel(arm, joint).motor.position();
  }
  bool torque(int arm) {
    for (int j = 0; j < 6; ++j) {
      if (channel(arm, j).drive().state == DriveState::kOperationEnabled)
        return true;
    }
    return false;
  }

 private:
  Board(const HardwareConfig& hardware, MyBus* bus) : System(hardware, only(bus)), bus_(*bus) {}
  static std::vector<std::unique_ptr<Fieldbus>> only(Fieldbus* bus) {
    std::vector<std::unique_ptr<Fieldbus>> buses;
    buses.emplace_back(bus);
    return buses;
  }
  MyBus& bus_;
};

class DriverOfAnotherKind : public testing::TestWithParam<DriveMode> {};

TEST_P(DriverOfAnotherKind, EnablesMovesHoldsAndLosesItsTorque) {
  Board board(GetParam());
  ASSERT_TRUE(board.boot()) << board.story();
  EXPECT_TRUE(board.robot->valid(0));
  EXPECT_FALSE(board.torque(0));
  const ArmVector start = board.robot->position(0);
  ASSERT_TRUE(board.enable()) << board.story();
  EXPECT_TRUE(board.torque(0));
  EXPECT_LT((board.robot->position(0) - start).cwiseAbs().maxCoeff(), 1e-6) << "enabled without a jump";

  const ArmVector speed = speeds(-2e-3, 0.2);
  board.move(0, speed);
  board.run(2.0);
  board.hold();
  board.run(0.5);
  EXPECT_TRUE(board.all(OperatingState::kEnabled)) << board.story();
  const ArmVector travel = board.robot->position(0) - start;
  for (int j = 0; j < 6; ++j) {
    EXPECT_NEAR(travel[j], 2.0 * speed[j], 0.1 * std::abs(2.0 * speed[j])) << j;
    EXPECT_NEAR(board.robot->position(0)[j], board.place(0, j), 1e-6) << j;
    EXPECT_NEAR(board.place(1, j), board.config.axes[static_cast<std::size_t>(6 + j)].gearing.offset, 1e-6) << j;
  }
  board.request(DriveRequest::kDisable);
  ASSERT_TRUE(board.until(3.0, [&] { return board.robot->off(); }));
  EXPECT_FALSE(board.torque(0) || board.torque(1));
  EXPECT_EQ(board.events.back().kind, HardwareEvent::Kind::kReady) << "no guard";
}

/// The motor's position is not a number, until it is where it was.
void garble(MyDriver& channel, bool on) {
  static double position = 0.0;
  if (on)
    position = channel.motor.position();
  channel.motor =
      sim::drives::Motor(channel.motor.parameters(), on ? std::numeric_limits<double>::quiet_NaN() : position);
}

struct Failure {
  const char* name;
  HardwareGuard guard;
  void (*set)(MyDriver& channel, bool on);
};

/// Each failure stops its arm and leaves the other one alone; without its cause the arm comes back and moves.
TEST_P(DriverOfAnotherKind, FailsAndComesBack) {
  constexpr Failure kFailures[] = {
      {"over-current", HardwareGuard::kDriveFault, [](MyDriver& c, bool on) { c.motor.faults.over_current = on; }},
      {"silent", HardwareGuard::kDriveSilent, [](MyDriver& c, bool on) { c.silent = on; }},
      {"not connected", HardwareGuard::kNode, [](MyDriver& c, bool on) { c.connected = !on; }},
      {"not a number", HardwareGuard::kDriveFault, garble},
      {"blocked", HardwareGuard::kFollowing, [](MyDriver& c, bool on) { c.motor.faults.blocked = on; }},
      {"runs away", HardwareGuard::kOverspeed, [](MyDriver& c, bool on) { c.motor.faults.runaway = on ? 1.0 : 0.0; }},
  };
  Board board(GetParam());
  ASSERT_TRUE(board.boot()) << board.story();
  for (const Failure& failure : kFailures) {
    SCOPED_TRACE(failure.name);
    board.events.clear();
    ASSERT_TRUE(board.enable()) << board.story();
    board.move(0, speeds(-2e-3, 0.2));
    board.move(1, speeds(-1e-3, 0.1));
    board.run(0.3);
    const std::uint64_t before = board.guardCount(failure.guard);
    failure.set(board.channel(0, 1), true);
    ASSERT_TRUE(board.until(1.0, [&] { return board.robot->state(0) == OperatingState::kFault; })) << board.story();
    board.hold();
    ASSERT_TRUE(board.until(3.0, [&] { return board.robot->arm(0).power() == ArmPower::kOff; })) << board.story();
    EXPECT_GT(board.guardCount(failure.guard), before) << board.story();
    EXPECT_EQ(board.robot->faultRecord(0).joint, 1);
    EXPECT_EQ(board.robot->state(1), OperatingState::kEnabled) << "the other arm goes on";
    failure.set(board.channel(0, 1), false);
    board.request(DriveRequest::kDisable);
    ASSERT_TRUE(board.until(10.0, [&] { return board.all(OperatingState::kDisabled) && board.allHomed(); }))
        << board.story();
    board.run(0.5);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes,
                         DriverOfAnotherKind,
                         testing::Values(DriveMode::kCyclicPosition, DriveMode::kCyclicVelocity));

/// The preset reads the emergency stop at an input of the first drive of each bus.
TEST(OwnDriver, ReportsTheEmergencyStop) {
  Board board;
  ASSERT_TRUE(board.boot());
  ASSERT_TRUE(board.enable()) << board.story();
  EXPECT_EQ(board.robot->emergencyStop(), safety::EmergencyStop::kReleased);
  board.channel(0, 0).input_bits = 0;
  board.run(0.02);
  EXPECT_EQ(board.robot->emergencyStop(), safety::EmergencyStop::kPressed);
  EXPECT_TRUE(board.all(OperatingState::kFault)) << board.story();
  ASSERT_TRUE(board.until(3.0, [&] { return board.robot->off(); }));
  board.request(DriveRequest::kDisable);
  board.run(3.0);
  EXPECT_TRUE(board.all(OperatingState::kFault)) << "still pressed";
  board.channel(0, 0).input_bits = ~0u;
  EXPECT_TRUE(board.until(10.0, [&] { return board.all(OperatingState::kDisabled) && board.allHomed(); }))
      << board.story();
  EXPECT_TRUE(board.enable()) << board.story();
}

TEST(OwnDriver, WithoutAStopOfItsOwnIsRefusedUnlessAccepted) {
  HardwareConfig hardware = boardHardware(DriveMode::kCyclicPosition);
  hardware.axes[2].accepted.clear();
  Board board(hardware);
  EXPECT_FALSE(board.boot());
  EXPECT_EQ(board.robot->arm(0).axis(2).phase(), AxisPhase::kFailed);
  EXPECT_EQ(board.robot->state(0), OperatingState::kFault);
  EXPECT_TRUE(board.robot->arm(1).homed());
  EXPECT_FALSE(board.enable());
  EXPECT_FALSE(board.torque(0));
  std::string log;
  for (const HardwareEvent& event : board.events)
    log += hal_service::describe(event, *board.robot) + "\n";
  EXPECT_NE(log.find("arm_a translation 3: the drive lacks command_deadline (1400:05), heartbeat_watch"), log.npos)
      << log;
}

TEST(OwnDriver, AllocatesNothingInThePeriodicPath) {
  if (!tandem::test::canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  Board board;
  ASSERT_TRUE(board.boot());
  ASSERT_TRUE(board.enable());
  board.move(0, speeds(-2e-3, 0.2));
  board.run(0.2);
  const std::size_t before = tandem::test::allocationCount();
  std::size_t events = 0;
  for (int k = 0; k < 200; ++k) {
    if (k == 100)
      board.channel(0, 1).motor.faults.over_current = true;
    if (k % 25 == 0)
      board.send();
    board.now += static_cast<std::int64_t>(1e9 * board.config.period);
    board.robot->step(board.now);
    while (board.robot->nextEvent(board.event))
      ++events;
  }
  EXPECT_EQ(tandem::test::allocationCount() - before, 0u);
  EXPECT_GT(events, 0u) << "the fault is in it";
}

TEST(OwnDriver, IsLoadedFromTheLibraryOfTheHardwareFile) {
  const HardwareConfig hardware = boardHardware(DriveMode::kCyclicPosition, TANDEM_MY_BOARD ",/dev/ttyUSB0");
  std::vector<std::unique_ptr<Fieldbus>> buses;
  buses.push_back(hal_service::openLibrary(hardware, 0));
  System system(hardware, std::move(buses));
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  const ArmVector start = system.robot->position(1);
  system.move(1, speeds(-1e-3, 0.1));
  system.run(1.0);
  EXPECT_NEAR((system.robot->position(1) - start)[3], 0.1, 0.02);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
}

/// The words of the exception.
std::string refusalOf(const std::string& library) {
  HardwareConfig hardware;
  hardware.buses.push_back({"board", "library:" + library});
  try {
    hal_service::openLibrary(hardware, 0);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "opened";
}

TEST(OwnDriver, IsRefusedWithTheFileAndTheReason) {
  EXPECT_NE(refusalOf("/nowhere/board.so").find("/nowhere/board.so: cannot open"), std::string::npos);
  EXPECT_EQ(refusalOf("libm.so.6"),
            "libm.so.6: found no function tandem_fieldbus that returns a bus, expected one (docs/own-hardware.md)");
  EXPECT_NE(
      refusalOf(TANDEM_OLD_BOARD).find("found a library for another version of tandem-hal (interface 0, expected"),
      std::string::npos)
      << refusalOf(TANDEM_OLD_BOARD);
}

}  // namespace
}  // namespace tandem::hal::test
