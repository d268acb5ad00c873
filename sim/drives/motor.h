// SPDX-License-Identifier: Apache-2.0
/** @file Simulated motor with position controller and winding temperature model; lengths in encoder counts. */
#pragma once

#include <limits>

namespace tandem::sim::drives {

struct MotorParameters {
  double max_velocity = 500e3;     ///< counts/s
  double max_acceleration = 20e6;  ///< counts/s^2, at twice the rated torque
  double position_gain = 120.0;    ///< 1/s
  double velocity_lag = 2e-3;      ///< time constant of the velocity loop, s
  double coast_lag = 20e-3;        ///< without power: friction, s
  double load = 0.0;               ///< acceleration of a back-drivable joint without power, counts/s^2
  double ambient = 25.0;           ///< deg C
  double rated_rise = 60.0;        ///< of the winding at rated current, K
  double thermal_lag = 60.0;       ///< s
  double low = -std::numeric_limits<double>::infinity();  ///< mechanical ends, counts
  double high = std::numeric_limits<double>::infinity();
  /// Torque per count beyond a mechanical end that gives way, with critical damping, per mille of rated; 0: rigid.
  double end_stiffness = 0.0;
};

/** Injected faults of the motor. */
struct MotorFaults {
  bool blocked = false;
  double speed = 1.0;         ///< share of the requested velocity that it reaches
  double load = 0.0;          ///< torque in addition to that of the motion, per mille of rated
  bool over_current = false;  ///< a winding draws several times the rated current
  bool over_heated = false;   ///< cooling failed: the winding is 100 K hotter
  double runaway = 0.0;       ///< not 0: with power it runs at this share of its largest speed, whatever the command
  bool no_brake = false;      ///< its brake does not hold
};

/** Motor integrated by explicit Euler steps; use at most a quarter of velocity_lag. */
class Motor {
 public:
  explicit Motor(const MotorParameters& parameters, double position = 0.0) noexcept;

  /// Follows a demand (counts, counts/s). dt in s.
  void follow(double position, double velocity, double dt) noexcept;
  /// Without power.
  void coast(double dt) noexcept;

  /// Largest torque of the power stage, per mille of rated (object 6072).
  void limitTorque(double most) noexcept { most_torque_ = most; }
  /// Somebody turns the shaft.
  void turn(double counts) noexcept { position_ += counts; }
  /// Closes or opens a brake that holds the motor with and without power.
  void setBrake(bool closed) noexcept { braked_ = closed; }

  double position() const noexcept { return position_; }
  double velocity() const noexcept { return velocity_; }
  double torque() const noexcept { return torque_; }  ///< per mille of rated
  double current() const noexcept;                    ///< per mille of rated
  double temperature() const noexcept;                ///< of the winding, deg C
  bool atLowEnd() const noexcept { return position_ <= parameters_.low; }
  bool atHighEnd() const noexcept { return position_ >= parameters_.high; }
  const MotorParameters& parameters() const noexcept { return parameters_; }

  MotorFaults faults;

 private:
  void move(double acceleration, double dt) noexcept;
  void heat(double dt) noexcept;

  MotorParameters parameters_;
  double position_;
  double velocity_ = 0.0;
  double torque_ = 0.0;
  double temperature_;
  double most_torque_ = 2000.0;
  bool braked_ = false;
};

}  // namespace tandem::sim::drives
