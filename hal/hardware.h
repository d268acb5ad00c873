// SPDX-License-Identifier: Apache-2.0
/** @file Hardware description of one robot: bus and node of each axis, conversion of counts. Filled by config from a
 * hardware file; SI units. */
#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "hal/drives/bus_load.h"
#include "hal/drives/cia402.h"
#include "hal/drives/protections.h"
#include "hal/drives/sdo_write.h"
#include "hal/drives/units.h"
#include "safety/limits.h"

namespace tandem::hal {

/** Expected identity of a node, object 0x1018; fields with value 0 are not checked. */
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
  int node_id = 127;        ///< node id of the HAL's heartbeat
  int sync_counter = 0;     ///< value after which the counter in SYNC begins again (1019), 2 to 240; 0: no counter
};

/** Source of the joint position after power on. */
enum class PositionReference : std::uint8_t {
  kAbsoluteEncoder = 0,  ///< a separate encoder (CiA 406) on the joint side: no motion needed
  kDrive,                ///< the drive keeps an absolute position
  kHoming,               ///< a homing run of the drive, requested after each start
  kHardStop,             ///< a run of the HAL against a mechanical stop, requested after each start
  kMeasured,  ///< a measurement from outside (gauge, tracker), sent after each start: Axis::takeMeasurement()
};

/** Mutual watch of HAL and drive: each detects the end of the other. */
enum class MutualWatch : std::uint8_t {
  kHeartbeat = 0,  ///< both send heartbeats: 1016, 1017
  kNodeGuarding,   ///< the HAL asks by remote frames, the drive answers: 100C, 100D
};

/** Means that hold an axis when its drive has no power. */
enum class HoldingMeans : std::uint8_t {
  kNo = 0,       ///< none declared
  kSelfLocking,  ///< a gear or a lead screw that cannot be driven from the joint
  kBrake,        ///< a brake that closes without power
};

/** Torque limit of an axis. */
struct TorqueLimit {
  std::uint16_t object = 0;  ///< 0x6077 torque or 0x6078 current actual value, in the feedback PDO; 0: not watched
  double limit = 1.0;        ///< share of the rated torque (6076) or current (6075)
  double time = 0.05;        ///< longest time above the limit, s: acceleration needs more torque
};

/** A run against a mechanical stop, found by torque and standstill. */
struct HardStopConfig {
  bool positive = false;  ///< direction in which the stop is
  double speed = 0.0;     ///< towards it, m/s or rad/s
  double torque = 0.0;    ///< limit of the drive during the run (6072), share of the rated torque
  double time = 0.1;      ///< at standstill with this torque, s: then it is the stop
};

/** A homing run (CiA 402 mode 6). A run against a mechanical stop has a position, an order and a budget, too. */
struct HomingConfig {
  int method = 0;             ///< object 0x6098
  double fast = 0.0;          ///< towards the switch, m/s or rad/s
  double slow = 0.0;          ///< off the switch or to the index, m/s or rad/s
  double acceleration = 0.0;  ///< m/s^2 or rad/s^2
  double position = 0.0;      ///< of the joint at the end of the run, m or rad
  int order = 0;              ///< axes with the same number run together, smaller numbers first
  double budget = 60.0;       ///< s
  /// Methods of the manufacturer: direction of the drive in which the mechanical stop is, -1 or 1; 0: other
  /// methods.
  int stop = 0;
  bool stop_index = false;  ///< it ends at the first index pulse behind that stop
};

/** An absolute encoder at the joint: of the profile CiA 406 beside a drive, or read by the drive itself. */
struct EncoderConfig {
  int node = 0;         ///< of an encoder on the bus
  int drive_input = 0;  ///< subindex of the drive's object 60E4 that shows the encoder; 0: it is on the bus
  DeviceIdentity identity;
  Gearing gearing;
  double tolerance = 0.0;  ///< largest difference to the drive's position, m or rad
  double range = 0.0;      ///< counts after which the encoder begins again at 0; 0: never

  bool atDrive() const noexcept { return drive_input != 0; }  ///< the drive reads it
};

/** A brake at a digital output of the drive (object 0x60FE), which the HAL opens and closes. */
struct BrakeConfig {
  int output_bit = 0;          ///< of 0x60FE:1
  bool closed_level = false;   ///< of that bit while the brake is closed; a brake without current is closed
  double closing_time = 0.05;  ///< time until the brake holds, s
  double opening_time = 0.05;  ///< time until the brake is open, s
  double slip = 0.0;           ///< largest permitted motion behind the closed brake, m or rad

  std::uint32_t mask() const noexcept { return std::uint32_t{1} << output_bit; }
  /// Value of 0x60FE:1 for a closed or open brake.
  std::uint32_t output(bool closed) const noexcept { return closed == closed_level ? mask() : 0; }
};

/** One joint and its drive. */
struct AxisConfig {
  std::string name;  ///< readable name: "arm_a translation 1"
  int arm = 0;
  int joint = 0;  ///< in the arm's joint vector
  bool translation = true;
  int bus = 0;
  int node = 0;
  DeviceIdentity identity;
  DriveMode mode = DriveMode::kCyclicPosition;
  Gearing gearing;
  DriveUnits units;
  double sdo_timeout = 0.1;  ///< longest time for the drive's or encoder's answer to an SDO request, s
  MutualWatch watch = MutualWatch::kHeartbeat;
  int pdo_objects = 8;  ///< most objects in one PDO of the drive
  /// Bits of the drive's digital inputs (60FD) that show its limit switches, in its own directions; -1: not read.
  int negative_switch = -1, positive_switch = -1;
  bool checks_counts = true;      ///< a drive that states other counts (608F, 6091, 6092) than `gearing` is refused
  bool reports_following = true;  ///< bit 12 of the statusword is 1 while the drive follows the target (CSP, CSV)
  double lower = 0.0;             ///< software limits of the drive, m or rad
  double upper = 0.0;
  double velocity = 0.0;                   ///< maximum speed of the axis, m/s or rad/s
  double slew_limit = safety::kUnlimited;  ///< largest change of the commanded velocity per second, m/s^2 or rad/s^2
  double quick_stop_deceleration = 0.0;    ///< m/s^2 or rad/s^2
  double following_error = 0.0;            ///< window of the drive and of the HAL, m or rad
  double following_time = 0.05;            ///< s for which the error may stay outside the window
  /// Largest travel of the first motion that contradicts its targets or the encoder (FirstMotion), m or rad.
  double first_motion = safety::kUnlimited;
  double velocity_gain = 10.0;  ///< 1/s: gain of the HAL's position loop in modes CSV and PV
  PositionReference reference = PositionReference::kAbsoluteEncoder;
  std::uint16_t temperature_index = 0;  ///< object with a temperature of the drive, 0: none
  std::uint8_t temperature_sub = 0;
  double temperature_scale = 1.0;  ///< degrees Celsius per unit of that object
  HoldingMeans powerless_hold = HoldingMeans::kNo;
  std::optional<ProtectionMask> foretold;  ///< what the drive may lack by its profile; none: it has no profile
  std::vector<AcceptedLoss> accepted;      ///< what this drive may lack although it is needed (leastProtections())
  std::vector<SdoWrite> sdo;               ///< written at boot, before everything that the HAL writes itself
  TorqueLimit torque;
  HomingConfig homing;          ///< used if reference is kHoming
  HardStopConfig hard_stop;     ///< used if reference is kHardStop
  double jump_tolerance = 0.0;  ///< largest jump of an absolute position while the HAL was off, m or rad; 0: any
  std::optional<EncoderConfig> encoder;
  std::optional<BrakeConfig> brake;

  /// The position is known only after a homing motion, which a client requests.
  bool needsRun() const noexcept {
    return reference == PositionReference::kHoming || reference == PositionReference::kHardStop;
  }
  /// Limit switches of the joint are read.
  bool hasSwitches() const noexcept { return negative_switch >= 0 || positive_switch >= 0; }
  /// The encoder is a node of its own.
  bool hasEncoderNode() const noexcept { return encoder && !encoder->atDrive(); }
  /// Object with torque or current in the feedback PDO; 0: none.
  std::uint16_t feedbackTorque() const noexcept {
    constexpr std::uint16_t kTorqueActual = 0x6077;
    return reference == PositionReference::kHardStop ? kTorqueActual : torque.object;
  }
  /// Time from maximum speed to standstill with the brake closed, with a margin, s.
  double stopBudget() const noexcept;
  /** Longest travel of the axis after the end of the HAL, m or rad: at `velocity` until the drive notices it, then its
   * quick stop. Infinite: the drive may continue. @param lost what the drive lacks. @param heartbeat_budget its
   * time-out for the HAL's heartbeat, s. */
  double travelWithoutHal(ProtectionMask lost, double heartbeat_budget) const noexcept;
};

/** Input with the state of the emergency stop, or of the STO of a drive. */
struct EmergencyInput {
  int axis = 0;             ///< index in HardwareConfig::axes of the drive that has the input
  bool statusword = false;  ///< bit of the statusword 6041; otherwise of the digital inputs 60FD
  int bit = 0;
  bool active_low = true;  ///< 0 means pressed, so that a broken wire means pressed, too
};

/** One arm of the robot. */
struct ArmConfig {
  std::string name;
  safety::ArmLimits limits;  ///< limits of the robot, cut by those of the axes: finite boxes and speeds
};

/** Hardware of a whole robot. */
struct HardwareConfig {
  std::string name;
  std::string robot_file;          ///< robot file that the joints belong to
  bool simulated = false;          ///< the nodes are simulated drives
  double period = 4e-3;            ///< of SYNC on all buses, s
  double node_heartbeat = 50e-3;   ///< period of the nodes' heartbeats, s
  double feedback_budget = 30e-3;  ///< longest time without a PDO of a node in operation, s; at least three periods
  double boot_budget = 3.0;        ///< longest time from a reset to the boot-up message of a node, s
  double transition_budget = 0.5;  ///< longest time for each state transition of a drive, s
  double power_budget = 2.0;       ///< longest time until all drives of an arm are in operation, s
  std::vector<BusConfig> buses;
  std::vector<ArmConfig> arms;
  std::vector<AxisConfig> axes;                ///< complete; arms in order, then their joints in order
  std::vector<EmergencyInput> emergency_stop;  ///< each of them stops all arms; empty: it cannot be read

  /// Traffic of one bus in operation, with the shortest request_interval of 1 to kLongestRequestInterval periods that
  /// fits the bus's load limit. @param heartbeat_budget time-out of the drives for the HAL's heartbeat, s.
  BusTraffic trafficOf(int bus, double heartbeat_budget) const;
  /// The calculator's input for one bus.
  BusPlan planOf(int bus, double heartbeat_budget) const;
};

/** Default slew limit if a hardware file has no `slew_limit`: time in which the commanded velocity rises from 0 to the
 * drive's `velocity`, s. It is the time that the default stop_deceleration of a robot (0.1 m/s^2, 20 rad/s^2) needs
 * from 10 mm/s and 2 rad/s to 0. With setpoints at 10 Hz, it acts only if a rotation reverses at more than half of its
 * speed. */
inline constexpr double kSlewTime = 0.1;

/// Defaults of AxisConfig::first_motion for translations, m, and rotations, rad.
inline constexpr double kFirstTranslation = 0.2e-3, kFirstRotation = 0.5 * std::numbers::pi / 180.0;

/// Deadline of the command PDO (1400:05), as share of the drives' time-out for the HAL's heartbeat.
inline constexpr double kDeadlineShare = 0.5;

/// Most periods per SDO request while an arm moves (BusTraffic::request_interval).
inline constexpr int kLongestRequestInterval = 10;

/// Requests of node guarding within the drives' time-out for the HAL: the life time factor.
inline constexpr int kGuardsPerBudget = 3;
/// Time between two of them, ms (100C). @param heartbeat_budget  time-out of the drives for the HAL, s
int guardTime(double heartbeat_budget) noexcept;

/// Heartbeats of the HAL within the drives' time-out.
inline constexpr double kHeartbeatsPerBudget = 4.0;

/// The digital inputs 60FD of the drive of an axis are read.
bool readsInputs(const HardwareConfig& hardware, const AxisConfig& axis) noexcept;

/// Every axis of an arm is declared to keep its position without power.
bool holdsWithoutPower(const HardwareConfig& hardware, int arm) noexcept;

/** Limits of the robot, cut by those of the axes of this arm.
 * @throw std::invalid_argument if a joint has no finite box or speed, or no range is left. */
safety::ArmLimits cutLimits(const safety::ArmLimits& robot, const std::vector<AxisConfig>& axes, int arm);

}  // namespace tandem::hal
