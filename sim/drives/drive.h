// SPDX-License-Identifier: Apache-2.0
/** @file Simulated servo drive (CiA 402). */
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string_view>

#include "sim/drives/device.h"
#include "sim/drives/homing_search.h"
#include "sim/drives/load_position.h"
#include "sim/drives/motor.h"

namespace tandem::sim::drives {

/** States of CiA 402. */
enum class DriveState : std::uint8_t {
  kNotReady,
  kSwitchOnDisabled,
  kReady,
  kSwitchedOn,
  kEnabled,
  kQuickStop,
  kFaultReaction,
  kFault,
};
std::string_view name(DriveState state);

/// Modes of operation, object 6060 of CiA 402.
inline constexpr int kProfilePosition = 1, kProfileVelocity = 3, kHomingMode = 6, kCyclicPosition = 8,
                     kCyclicVelocity = 9;

/** Holding brake at an output of the drive, object 60FE. */
struct BrakeSpec {
  std::uint32_t mask = 1;     ///< its bit in 60FE:1; effective only if it is set in 60FE:2, too
  bool closed_level = false;  ///< of that bit while the brake is closed
  double time = 0.03;         ///< until it holds, or is open, s
};

/** One drive of a bus. Positions in counts. */
struct DriveSpec {
  std::uint8_t id = 1;
  std::uint32_t serial = 1;
  double start = 0.0;        ///< position at the start of the simulation
  bool incremental = false;  ///< the encoder counts from 0 at power on; else it keeps the position
  /// Counts/s and counts/s^2 in one unit of the objects with velocities and accelerations, if the data sheet does not
  /// state it (60A9, 60AA); 0: 1.
  double velocity_unit = 0.0, acceleration_unit = 0.0;
  double counts_per_revolution = 0.0;  ///< of the motor, if the data sheet has no 608F; 0: that of the built-in drive
  Habits habits;
  std::optional<BrakeSpec> brake;
  LoadSpec load;                   ///< of a further encoder, at the joint, that the drive reads
  std::uint8_t load_input = 1;     ///< sub-index of 60E4 that shows it
  ObjectAddress temperature;       ///< number that shows the temperature; index 0: 2001 of the built-in drive
  double temperature_scale = 1.0;  ///< degrees Celsius per unit of that object
  Switches switches;
  std::int64_t stop_number = 0;  ///< homing method (6098) of the manufacturer that searches a mechanical stop; 0: none
  HomingMethod stop_method;      ///< what it does
  MotorParameters motor;
};

/** Injected errors of a sensor reading. */
struct SensorFaults {
  bool frozen = false;
  bool garbage = false;
  bool alarm = false;
  double offset = 0.0;  ///< counts

  /// Reading for a true `value`. `held` stores the last good reading.
  std::int32_t distort(double value, std::int32_t& held, std::mt19937& random) const noexcept;
};

/** Statistics of a drive's motion and stops, since construction or mark(). */
struct DriveRecord {
  double max_following_error = 0.0;  ///< counts
  double max_jump = 0.0;             ///< largest distance from the demand to a new cyclic target, counts
  std::uint64_t limit_hits = 0;      ///< targets outside the software limits
  std::uint64_t quick_stops = 0;
  std::uint64_t faults = 0;
  std::uint64_t contact_losses = 0;
  double travel = 0.0;  ///< path, counts
  double lowest = 0.0;  ///< position, counts
  double highest = 0.0;
  double peak_velocity = 0.0;  ///< counts/s
  /// Last stop that the drive made by itself (quick stop, fault): start, ns, path and duration.
  std::int64_t stop_begin = 0;
  double stop_travel = 0.0;
  double stop_duration = 0.0;  ///< s
  /// Longest time without a command PDO after which the drive was still in operation, s.
  double longest_silence = 0.0;
};

class Drive final : public Device {
 public:
  /// @throw std::invalid_argument if the data sheet lacks an object.
  Drive(const DriveSpec& spec, const Eds& eds);

  DriveState state() const noexcept { return state_; }
  int mode() const noexcept { return static_cast<int>(mode_display_.value); }
  const Motor& motor() const noexcept { return motor_; }
  Motor& motor() noexcept { return motor_; }
  /// The encoder at the joint, undisturbed.
  const LoadPosition& load() const noexcept { return load_; }
  SensorFaults sensor;  ///< of the motor's encoder; `alarm` is a fault of the drive
  /** The emergency stop removes the torque (STO): the motor coasts, the drive changes to "switch on disabled" and stays
   * there. Statusword: bit 14 (of the manufacturer) is 1, bit 4 (voltage enabled) is 0. */
  bool emergency_stop = false;
  /// Bit of the digital inputs 60FD: 1 while the emergency stop chain is closed.
  static constexpr int kEmergencyInput = 16;

  /// True position in the drive's coordinates, counts.
  double position() const noexcept { return motor_.position() + zero_; }
  double demand() const noexcept { return demand_; }
  const DriveRecord& record() const noexcept { return record_; }
  /// Starts a new record.
  void mark() noexcept;

 private:
  // Ramp of a stop, with the state that follows it.
  struct Brake {
    bool active = false;
    double deceleration = 0.0;
    DriveState then = DriveState::kSwitchOnDisabled;
    bool stay = false;  ///< keeps the present state
  };

  void step(double dt) noexcept override;
  void refresh() noexcept override;
  void written(const Entry& entry) noexcept override;
  SdoAbort accept(const Entry& entry, std::int64_t value) const noexcept override;
  void contactLost() noexcept override;
  void resetApplication() noexcept override;

  // State machine (drive.cpp).
  void onControlword(std::uint16_t word) noexcept;
  void command(std::uint16_t word) noexcept;
  void leaveEnabled(std::uint16_t word) noexcept;
  void enter(DriveState state) noexcept;
  void quickStop() noexcept;
  void fail(std::uint16_t code, ErrorBit bit) noexcept;
  void resetFault() noexcept;
  bool causePersists() const noexcept;
  double temperatureLimit() const noexcept;  ///< degrees Celsius
  bool moves() const noexcept;               ///< the power stage is on
  void brakeTo(double deceleration, DriveState then, bool stay) noexcept;
  void moveBrake(double dt) noexcept;
  void monitor(double dt) noexcept;
  void note(double dt, double before) noexcept;
  std::uint16_t statusword() const noexcept;
  std::uint16_t modeBits() const noexcept;
  std::int64_t valueOf(std::uint16_t index) const noexcept;
  double velocityOf(std::uint16_t index, std::uint8_t sub = 0) noexcept;      ///< counts/s
  double accelerationOf(std::uint16_t index, std::uint8_t sub = 0) noexcept;  ///< counts/s^2

  // Motion (drive_motion.cpp). All in the drive's coordinates.
  double fastest() noexcept;  ///< speed that a profile may have, counts/s
  void generate(double dt) noexcept;
  void slowDown(double deceleration, double dt) noexcept;
  void endBrake() noexcept;
  void cyclicPosition(double dt) noexcept;
  void profilePosition(double dt) noexcept;
  void followVelocity(double acceleration, double deceleration, double dt) noexcept;
  void takeSetPoint() noexcept;
  void homing(double dt) noexcept;
  void homed() noexcept;
  std::optional<HomingMethod> homingMethod(std::int64_t number) const noexcept;
  double countsPerRevolution() noexcept;
  void approach(double velocity, double acceleration, double dt) noexcept;
  void takeTarget() noexcept;
  double limited(double target) noexcept;
  double interpolationPeriod() const noexcept;
  void adoptPosition() noexcept;

  DriveSpec spec_;
  Motor motor_;
  LoadPosition load_;
  std::mt19937 random_;
  Entry &controlword_, &statusword_, &error_code_, &mode_, &mode_display_;
  Entry &target_, &actual_, &demand_value_, &velocity_actual_, &following_;
  Entry &load_actual_, &torque_, &current_, &inputs_, &max_torque_;
  Entry *temperature_, *temperature_limit_;  ///< nullptr: not in the objects
  DriveState state_ = DriveState::kNotReady;
  DriveRecord record_;
  double zero_ = 0.0;  ///< zero of the drive's coordinates minus that of the motor's
  double demand_ = 0.0;
  double demand_velocity_ = 0.0;
  double segment_start_ = 0.0;  ///< CSP
  double segment_end_ = 0.0;
  double segment_time_ = 0.0;
  Brake brake_;
  bool halted_ = false;
  bool limited_ = false;
  bool stopping_ = false;      ///< a stop by the drive itself is being recorded
  double braked_ = 1.0;        ///< share of closing, 0 open to 1 closed
  double error_time_ = 0.0;    ///< outside the following error window, s
  double reached_time_ = 0.0;  ///< inside the position window, s
  std::uint16_t last_word_ = 0;
  double profile_target_ = 0.0;
  std::optional<double> next_target_;
  bool acknowledged_ = false;
  HomingSearch search_;
  bool homed_ = false;         ///< the end of the search has set the zero
  double homing_stall_ = 0.0;  ///< time for which the motor has not followed a search, s
  std::int32_t held_reading_ = 0;
};

}  // namespace tandem::sim::drives
