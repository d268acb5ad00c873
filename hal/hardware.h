// SPDX-License-Identifier: Apache-2.0
/** @file Hardware description of one robot: bus and node of each axis, conversion of counts. Filled by config from a
 * hardware file; SI units. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/drives/bus_load.h"
#include "hal/drives/cia402.h"
#include "hal/drives/units.h"
#include "safety/limits.h"

namespace tandem::hal {

/** What a node has to say of itself in object 0x1018; what is 0 is not checked. */
struct DeviceIdentity {
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
};

/** One CAN bus. */
struct BusConfig {
  std::string name;
  std::string address;      ///< "can:can0", "unix:/path"
  double bit_rate = 1e6;    ///< bit/s
  double load_limit = 0.6;  ///< share of the bit rate that the cyclic traffic may use
  int node_id = 127;        ///< under which the HAL sends its heartbeat
};

/** Where an axis knows its position from after power on. */
enum class PositionReference : std::uint8_t {
  kAbsoluteEncoder = 0,  ///< an encoder of its own (CiA 406) on the joint side: nothing has to move
  kDrive,                ///< the drive keeps an absolute position
  kHoming,               ///< a homing run of the drive, to be asked for after each start
};

/** What keeps an axis where it is when its drive has no power. */
enum class HoldingMeans : std::uint8_t {
  kNo = 0,       ///< nothing that anybody has declared
  kSelfLocking,  ///< a gear or a lead screw that cannot be driven from the joint
  kBrake,        ///< a brake that closes without power
};

/** How much torque an axis may need. */
struct TorqueLimit {
  std::uint16_t object = 0;  ///< 0x6077 torque or 0x6078 current actual value, in the feedback PDO; 0: not watched
  double limit = 1.0;        ///< share of the rated torque (6076) or current (6075)
  double time = 0.05;        ///< s for which it may be beyond: speeding up takes more
};

/** A homing run (CiA 402 mode 6). */
struct HomingConfig {
  int method = 0;             ///< object 0x6098
  double fast = 0.0;          ///< towards the switch, m/s or rad/s
  double slow = 0.0;          ///< off the switch or to the index
  double acceleration = 0.0;  ///< m/s^2 or rad/s^2
  double position = 0.0;      ///< of the joint where the run ends, m or rad
  int order = 0;              ///< axes with the same number run together, smaller numbers first
  double budget = 60.0;       ///< s
};

/** An absolute encoder of the profile CiA 406 beside a drive. */
struct EncoderConfig {
  int node = 0;
  DeviceIdentity identity;
  Gearing gearing;
  double tolerance = 0.0;  ///< largest difference to the drive's position, m or rad
};

/** A brake at a digital output of the drive (object 0x60FE), which the HAL opens and closes. */
struct BrakeConfig {
  int output_bit = 0;          ///< of 0x60FE:1
  bool closed_level = false;   ///< of that bit while the brake is closed; a brake without current is closed
  double closing_time = 0.05;  ///< s until it holds
  double opening_time = 0.05;  ///< s until it lets go
  double slip = 0.0;           ///< what a joint may move behind the closed brake, m or rad

  std::uint32_t mask() const noexcept { return std::uint32_t{1} << output_bit; }
  /// Value of 0x60FE:1.
  std::uint32_t output(bool closed) const noexcept { return closed == closed_level ? mask() : 0; }
};

/** One joint and its drive. */
struct AxisConfig {
  std::string name;  ///< for people: "arm_a translation 1"
  int arm = 0;
  int joint = 0;  ///< in the arm's joint vector
  bool translation = true;
  int bus = 0;
  int node = 0;
  DeviceIdentity identity;
  DriveMode mode = DriveMode::kCyclicPosition;
  Gearing gearing;
  double lower = 0.0;  ///< the drive's own software limits, m or rad
  double upper = 0.0;
  double velocity = 0.0;                   ///< the fastest that the axis may move, m/s or rad/s
  double slew_limit = safety::kUnlimited;  ///< largest change of the commanded velocity per second, m/s^2 or rad/s^2
  double quick_stop_deceleration = 0.0;    ///< m/s^2 or rad/s^2
  double following_error = 0.0;            ///< window of the drive and of the HAL, m or rad
  double following_time = 0.05;            ///< s for which the error may stay outside the window
  double velocity_gain = 10.0;             ///< 1/s: mode CSV closes the position loop with it
  PositionReference reference = PositionReference::kAbsoluteEncoder;
  std::uint16_t temperature_index = 0;  ///< object with a temperature of the drive, 0: none
  std::uint8_t temperature_sub = 0;
  double temperature_scale = 1.0;  ///< degrees Celsius per unit of that object
  HoldingMeans powerless_hold = HoldingMeans::kNo;
  TorqueLimit torque;
  HomingConfig homing;  ///< where reference is kHoming
  std::optional<EncoderConfig> encoder;
  std::optional<BrakeConfig> brake;

  /// From the fastest that the axis may be to standstill, with its brake closed, and a margin, s.
  double stopBudget() const noexcept;
};

/** Where the emergency stop, or the STO of a drive, can be read. */
struct EmergencyInput {
  int axis = 0;             ///< index in HardwareConfig::axes: whose drive tells
  bool statusword = false;  ///< bit of the statusword 6041; otherwise of the digital inputs 60FD
  int bit = 0;
  bool active_low = true;  ///< 0 means pressed, so that a broken wire does, too
};

/** One arm of the robot. */
struct ArmConfig {
  std::string name;
  safety::ArmLimits limits;  ///< those of the robot, cut by what the axes can do: finite boxes and speeds
};

/** A whole robot's hardware. */
struct HardwareConfig {
  std::string name;
  std::string robot_file;          ///< whose joints these are
  bool simulated = false;          ///< the nodes are simulated drives
  double period = 4e-3;            ///< of SYNC on all buses, s
  double node_heartbeat = 50e-3;   ///< period of the nodes' heartbeats, s
  double feedback_budget = 30e-3;  ///< for which a node in operation may owe its PDO, s; three periods at the least
  double boot_budget = 3.0;        ///< for a node to say that it is there after a reset, s
  double transition_budget = 0.5;  ///< for a drive to take each step of its state machine, s
  double power_budget = 2.0;       ///< for all drives of an arm to be in operation, s
  std::vector<BusConfig> buses;
  std::vector<ArmConfig> arms;
  std::vector<AxisConfig> axes;                ///< arms in order, their joints in order: complete
  std::vector<EmergencyInput> emergency_stop;  ///< any of them stops all arms; empty: it cannot be read

  /// Traffic of one bus in operation. @param heartbeat_budget time-out of the drives for the HAL's heartbeat, s.
  BusTraffic trafficOf(int bus, double heartbeat_budget) const;
  /// The calculator's input for one bus.
  BusPlan planOf(int bus, double heartbeat_budget) const;
};

/** A hardware file that says nothing of `slew_limit` lets a commanded velocity go from nothing to the drive's
 * `velocity` in this time, s: as fast as the default stop_deceleration of a robot takes it back (0.1 m/s^2, 20 rad/s^2)
 * at 10 mm/s and 2 rad/s. It does not act on setpoints at 10 Hz but when a rotation turns round at more than half of
 * its speed. */
inline constexpr double kSlewTime = 0.1;

/// The HAL sends its heartbeat so many times within the drives' time-out.
inline constexpr double kHeartbeatsPerBudget = 4.0;

/// Whether the digital inputs 60FD of the drive of an axis are read.
bool readsInputs(const HardwareConfig& hardware, const AxisConfig& axis) noexcept;

/// Whether every axis of an arm is declared to stay where it is without power.
bool holdsWithoutPower(const HardwareConfig& hardware, int arm) noexcept;

/** The robot's limits, cut by what the axes of this arm can do.
 * @throw std::invalid_argument where a joint has no finite box or speed, or no room is left. */
safety::ArmLimits cutLimits(const safety::ArmLimits& robot, const std::vector<AxisConfig>& axes, int arm);

}  // namespace tandem::hal
