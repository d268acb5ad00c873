// SPDX-License-Identifier: Apache-2.0
/** @file Fault matrix of devices: every fault of tandem-drive-sim on a drive, an encoder and a bus of a moving arm;
 * detection time, reaction and standstill of each axis. Prints JSON, which tests/fault/matrix/matrix_test.py
 * evaluates.
 *
 * Two arms on two simulated buses in simulated time: the results show the HAL's reaction, independently of this
 * machine's load. */
#include <iostream>
#include <nlohmann/json.hpp>

#include "hal/canopen/cob.h"
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

using Json = nlohmann::ordered_json;

/// Speeds of the arm with the fault, m/s and rad/s, and share of them for the other one.
constexpr double kTranslation = 4e-3, kRotation = 0.3, kShare = 0.25;
/// Thresholds of standstill, m/s and rad/s.
constexpr double kStill = 2e-5, kStillRotation = 2e-3;
constexpr int kRuns = 5;  ///< of each fault, at different times of a control period
constexpr int kDrive = 2, kRotationDrive = 5, kEncoder = 18, kBus = 0;

struct Case {
  const char* where;
  int node;
  FaultKind kind;
  double value;
};

/// Rows of drives with a torque limit; the guard is off by default.
constexpr const char* kWithTorqueLimit = "drive, torque_limit";
constexpr TorqueLimit kTorqueLimit{0x6077, 0.8, 0.05};

/// Rows with another motion than all joints at once, or with other drives.
constexpr const char *kOneAxis = "one axis moves", *kVelocityMode = "velocity mode",
                     *kProfileVelocity = "profile velocity", *kBraked = "braked, falls without", *kHoming = "homing",
                     *kWithdrawal = "withdrawal";

constexpr Case kCases[] = {
    {"drive", kDrive, FaultKind::kOff, 0},
    {"drive", kDrive, FaultKind::kStuck, 0},
    {"drive, rotation", kRotationDrive, FaultKind::kStuck, 0},
    {"drive", kDrive, FaultKind::kGarbage, 0},
    {"drive", kDrive, FaultKind::kWrong, 0},
    {"drive", kDrive, FaultKind::kSlow, 0.2},
    {"drive", kDrive, FaultKind::kSlow, 0.001},
    {"drive", kDrive, FaultKind::kDelayed, 20},
    {"drive", kDrive, FaultKind::kDelayed, 300},
    {"drive", kDrive, FaultKind::kIntermittent, 200},
    {"drive", kDrive, FaultKind::kOverCurrent, 0},
    {"drive", kDrive, FaultKind::kOverTemperature, 0},
    {"drive", kDrive, FaultKind::kEncoderAlarm, 0},
    {"drive", kDrive, FaultKind::kFrameLoss, 0.1},
    {"drive", kDrive, FaultKind::kFrameLoss, 1},
    {"drive", kDrive, FaultKind::kByteFlips, 0.1},
    {"drive", kDrive, FaultKind::kBabbling, 2000},
    {"drive", kDrive, FaultKind::kEmergencyStop, 0},
    {"drive", kDrive, FaultKind::kOverload, 900},
    {kWithTorqueLimit, kDrive, FaultKind::kOverload, 900},
    {"encoder", kEncoder, FaultKind::kOff, 0},
    {"encoder", kEncoder, FaultKind::kStuck, 0},
    {"encoder", kEncoder, FaultKind::kGarbage, 0},
    {"encoder", kEncoder, FaultKind::kWrong, 50000},
    {"encoder", kEncoder, FaultKind::kDelayed, 20},
    {"encoder", kEncoder, FaultKind::kDelayed, 300},
    {"encoder", kEncoder, FaultKind::kIntermittent, 200},
    {"encoder", kEncoder, FaultKind::kEncoderAlarm, 0},
    {"encoder", kEncoder, FaultKind::kFrameLoss, 0.1},
    {"encoder", kEncoder, FaultKind::kFrameLoss, 1},
    {"encoder", kEncoder, FaultKind::kByteFlips, 0.1},
    {"encoder", kEncoder, FaultKind::kBabbling, 2000},
    {"drive", kDrive, FaultKind::kRunaway, 0},
    {kOneAxis, kDrive, FaultKind::kOff, 0},
    {kOneAxis, kDrive, FaultKind::kOverTemperature, 0},
    {kOneAxis, kEncoder, FaultKind::kEncoderAlarm, 0},
    {kOneAxis, kEncoder, FaultKind::kWrong, 50000},
    {kVelocityMode, kDrive, FaultKind::kOff, 0},
    {kVelocityMode, kDrive, FaultKind::kOverTemperature, 0},
    {kVelocityMode, kEncoder, FaultKind::kEncoderAlarm, 0},
    {kProfileVelocity, kDrive, FaultKind::kOff, 0},
    {kProfileVelocity, kDrive, FaultKind::kOverTemperature, 0},
    {kProfileVelocity, kEncoder, FaultKind::kEncoderAlarm, 0},
    {kBraked, kDrive, FaultKind::kOff, 0},
    {kBraked, kDrive, FaultKind::kOverTemperature, 0},
    {kBraked, kEncoder, FaultKind::kEncoderAlarm, 0},
    {kHoming, kDrive, FaultKind::kOverTemperature, 0},
    {kHoming, kDrive, FaultKind::kOff, 0},
    {kWithdrawal, kDrive, FaultKind::kOff, 0},
    {kWithdrawal, kEncoder, FaultKind::kEncoderAlarm, 0},
    {"bus", kBus, FaultKind::kOff, 0},
    {"bus", kBus, FaultKind::kFrameLoss, 0.1},
    {"bus", kBus, FaultKind::kFrameLoss, 1},
    {"bus", kBus, FaultKind::kBusOff, 0},
    {"bus", kBus, FaultKind::kEmergencyStop, 0},
};

/// One frame that only a master sends, from another node on arm_a's bus.
struct ForeignCase {
  const char* name;
  can::CanFrame frame;
};

const ForeignCase kForeignCases[] = {
    {"sync", canopen::syncFrame(0)},
    {"heartbeat", canopen::heartbeatFrame(127, canopen::NmtState::kOperational)},
    {"reset_all", canopen::nmtFrame(canopen::NmtCommand::kResetNode, 0)},
    {"command_pdo", can::makeFrame(canopen::cob::rpdo(1, kDrive), std::array<std::uint8_t, 6>{})},
};

/** One arm's motors, in SI. */
struct Motors {
  System& system;
  int arm;

  double scale(int joint) const { return AxisUnits(system.robot->arm(arm).axis(joint).config().gearing).scale(); }
  ArmVector position() const {
    ArmVector q(6);
    for (int j = 0; j < 6; ++j)
      q[j] = scale(j) * system.drive(arm, j).motor().position();
    return q;
  }
  int moving() const {
    int count = 0;
    for (int j = 0; j < 6; ++j) {
      const double speed = std::abs(scale(j) * system.drive(arm, j).motor().velocity());
      count += speed > (j < 3 ? kStill : kStillRotation) ? 1 : 0;
    }
    return count;
  }
};

double milliseconds(std::int64_t time) { return time < 0 ? -1.0 : 1e-6 * static_cast<double>(time); }

/// Events from the injection to 2 s later.
struct Story {
  std::int64_t begin = 0;
  std::int64_t noticed = -1, standing = -1;  ///< ns after the injection
  GuardMask guards = 0;
  double violation = -1.0;  ///< of equation (1) and the box limits by the true joints, m or rad

  void watch(System& system, const Motors& hurt) {
    const std::int64_t passed = system.now - begin;
    if (noticed < 0 && system.robot->state(0) == OperatingState::kFault)
      noticed = passed;
    if (hurt.moving() > 0)
      standing = -1;
    else if (standing < 0)
      standing = passed;
    violation = std::max(violation, safety::largestViolation(system.config.arms[0].limits, system.truth(0)));
  }
};

std::string statesOf(System& system) {
  std::map<std::string, int> states;
  for (int j = 0; j < 6; ++j)
    ++states[std::string(name(system.drive(0, j).state()))];
  std::string text;
  for (const auto& [state, count] : states)
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + state;
  return text;
}

void changeAxis(std::string_view where, AxisConfig& axis) {
  if (where == kWithTorqueLimit)
    axis.torque = kTorqueLimit;
  if (where == kVelocityMode || where == kProfileVelocity) {
    axis.mode = where == kVelocityMode ? DriveMode::kCyclicVelocity : DriveMode::kProfileVelocity;
    axis.velocity_gain = 20.0;
    axis.following_error = axis.translation ? 1e-3 : 0.1;
  }
  if (where == kBraked && axis.arm == 0 && axis.translation) {
    axis.brake.emplace();
    axis.brake->slip = 50e-6;
  }
  if (where == kHoming && axis.arm == 0 && axis.translation) {
    axis.reference = PositionReference::kHoming;
    axis.homing = {17, 2.0 * kTranslation, 1e-3, 0.2, axis.lower + 0.01, 0, 60.0};
  }
}

HardwareConfig hardwareOf(std::string_view where) {
  HardwareConfig hardware = presetHardware();
  for (AxisConfig& axis : hardware.axes)
    changeAxis(where, axis);
  return hardware;
}

/// Starts the motion of both arms, of the first one according to the row.
void begin(System& system, std::string_view where, int run) {
  const auto require = [&](bool good, const char* what) {
    if (!good)
      throw std::runtime_error(std::string(what) + "\n" + system.story());
  };
  const bool homes = where == kHoming;
  require(system.boot() || homes, "the arms do not come up");
  system.command.request[1] = DriveRequest::kEnable;
  system.command.request[0] = homes ? DriveRequest::kKeep : DriveRequest::kEnable;
  if (where == kWithdrawal) {
    system.command.request[0] = DriveRequest::kRecover;
    system.command.without[0] = safety::jointBit(2);
  }
  require(system.until(3.0,
                       [&] {
                         return system.robot->state(1) == OperatingState::kEnabled &&
                                (homes || system.robot->state(0) == OperatingState::kEnabled);
                       }),
          "the arms do not come into operation");
  system.request(DriveRequest::kKeep);
  ArmVector v(6);
  v << kTranslation, kTranslation, kTranslation, kRotation, kRotation, kRotation;
  system.move(1, kShare * v);
  if (where == kOneAxis)
    v.tail(4).setZero(), v[0] = 0.0;
  if (where == kWithdrawal)
    v = -v;
  if (homes)
    system.robot->home(0, system.now);
  else
    system.move(0, v);
  system.run(0.5 + 0.1 / kRuns * run);
  require(system.robot->state(1) == OperatingState::kEnabled && system.robot->arm(0).homing() == homes &&
              (homes || system.robot->state(0) == OperatingState::kEnabled),
          "an arm stops by itself");
}

/// @param hurt_it  injects the fault into the first arm; false: impossible
Json measure(const std::function<bool(System&)>& hurt_it, int run, std::string_view where) {
  System system(hardwareOf(where));
  begin(system, where, run);
  const Motors hurt{system, 0}, other{system, 1};
  const ArmVector before = hurt.position();
  Story story;
  story.begin = system.now;
  system.events.clear();
  system.after_period = [&] { story.watch(system, hurt); };
  if (!hurt_it(system))
    throw std::runtime_error("the fault cannot be injected");
  system.run(2.0);
  for (const HardwareEvent& event : system.events)
    story.guards |= event.kind == HardwareEvent::Kind::kGuard && event.arm == 0 ? event.guards : 0;
  const ArmVector way = (hurt.position() - before).cwiseAbs();
  return {{"noticed_ms", milliseconds(story.noticed)},
          {"standing_ms", milliseconds(story.standing)},
          {"travel_mm", 1e3 * way.head(3).maxCoeff()},
          {"travel_deg", way.tail(3).maxCoeff() * 180.0 / M_PI},
          {"violation_mm", 1e3 * std::max(0.0, story.violation)},
          {"guards", describeGuards(story.guards)},
          {"faults", safety::describeFaults(system.robot->faults(0))},
          {"cause", safety::describe(system.robot->faultRecord(0), &system.config.arms[0].limits)},
          {"state", system.robot->state(0) == OperatingState::kFault ? "FAULT" : "ENABLED"},
          {"other_state", system.robot->state(1) == OperatingState::kEnabled ? "ENABLED" : "FAULT"},
          {"moving", hurt.moving()},
          {"other_moving", other.moving()},
          {"drives", statesOf(system)}};
}

/// Objects of the drives' data sheet, what is lost without them, and how drives and HAL notice each other's end.
struct Lack {
  std::vector<canopen::ObjectAddress> objects;
  ProtectionMask lost = 0;
  MutualWatch watch = MutualWatch::kHeartbeat;
};

const Lack kLacks[] = {
    {{}, 0},
    {{{0x1400, 5}}, bit(Protection::kCommandDeadline)},
    {{{0x1016, 1}}, bit(Protection::kHeartbeatWatch)},
    {{{0x1400, 5}, {0x1016, 1}}, bit(Protection::kCommandDeadline) | bit(Protection::kHeartbeatWatch)},
    {{{0x6007, 0}}, bit(Protection::kConnectionReaction)},
    {{{0x605A, 0}, {0x6085, 0}}, bit(Protection::kQuickStopRamp)},
    {{{0x1400, 5}, {0x1016, 1}}, bit(Protection::kCommandDeadline), MutualWatch::kNodeGuarding},
    {{{0x1400, 5}, {0x1016, 1}, {0x100D, 0}},
     bit(Protection::kCommandDeadline) | bit(Protection::kHeartbeatWatch),
     MutualWatch::kNodeGuarding},
};

/// The HAL ends while an arm moves whose drives lack this, accepted for each axis.
Json measureEnd(DriveMode mode, const Lack& lack) {
  constexpr double kTime = 3.0, kEnd = 0.5;  // s
  HardwareConfig config = presetHardware(mode);
  for (AxisConfig& axis : config.axes) {
    axis.watch = lack.watch;
    for (int k = 0; k < kProtectionCount; ++k)
      axis.accepted.push_back({static_cast<Protection>(k), "measured"});
  }
  sim::drives::Eds eds = sim::drives::driveEds();
  std::erase_if(eds.objects, [&](const auto& o) { return std::ranges::count(lack.objects, o.address) > 0; });
  System system(config, 0.0, eds);
  begin(system, "drive", 0);
  const Motors motors{system, 0};
  const ArmVector before = motors.position();
  system.hal_alive = false;
  std::int64_t standing = -1;
  const std::int64_t ended = system.now;
  while (system.now < ended + static_cast<std::int64_t>(1e9 * kTime)) {
    system.period();
    if (motors.moving() > 0)
      standing = -1;
    else if (standing < 0)
      standing = system.now - ended;
  }
  const ArmVector way = (motors.position() - before).cwiseAbs();
  const Axis& axis = system.robot->arm(0).axis(1);
  AxisConfig slow = axis.config();
  slow.velocity = kTranslation;
  const double travel = slow.travelWithoutHal(axis.driver().lostProtections(), safety::Budgets{}.drive_heartbeat);
  Json row{{"mode", name(mode)},
           {"watch", lack.watch == MutualWatch::kHeartbeat ? "heartbeat" : "node guarding"},
           {"lost", describeProtections(axis.driver().lostProtections())},
           {"standing_ms",
            standing < 0 || standing > static_cast<std::int64_t>(1e9 * (kTime - kEnd)) ? -1.0 : milliseconds(standing)},
           {"travel_mm", 1e3 * way.head(3).maxCoeff()},
           {"as_expected", axis.driver().lostProtections() == lack.lost}};
  row["bound_mm"] = std::isfinite(travel) ? Json(1e3 * travel) : Json();
  return row;
}

}  // namespace
}  // namespace tandem::hal::test

int main() {
  using namespace tandem::hal::test;
  try {
    const auto hardware = presetHardware();
    Json all{{"period_ms", 1e3 * hardware.period},
             {"speed_mm_per_s", 1e3 * kTranslation},
             {"speed_deg_per_s", kRotation * 180.0 / M_PI},
             {"runs", kRuns},
             {"rows", Json::array()}};
    for (const Case& fault : kCases) {
      Json row{{"where", fault.where}, {"fault", name(fault.kind)}, {"value", fault.value}, {"runs", Json::array()}};
      for (int run = 0; run < kRuns; ++run)
        row["runs"].push_back(measure(
            [&](System& system) { return system.inject(0, fault.kind, fault.node, fault.value); }, run, fault.where));
      all["rows"].push_back(row);
    }
    for (const ForeignCase& foreign : kForeignCases) {
      Json row{{"where", "foreign master"}, {"fault", foreign.name}, {"value", 0}, {"runs", Json::array()}};
      const auto send = [&](System& system) {
        return system.wires[0]->bus.join("foreign").send({&foreign.frame, 1}) == 1;
      };
      for (int run = 0; run < kRuns; ++run)
        row["runs"].push_back(measure(send, run, row["where"].get<std::string>()));
      all["rows"].push_back(row);
    }
    all["ends"] = Json::array();
    for (const auto mode : {tandem::hal::DriveMode::kCyclicPosition, tandem::hal::DriveMode::kCyclicVelocity,
                            tandem::hal::DriveMode::kProfileVelocity}) {
      for (const Lack& lack : kLacks)
        all["ends"].push_back(measureEnd(mode, lack));
    }
    std::cout << all.dump(1) << '\n';
  } catch (const std::exception& error) {
    std::cerr << "device_faults: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
