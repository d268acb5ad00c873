// SPDX-License-Identifier: Apache-2.0
/** @file Interface of operator input devices. */
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "planning/teleoperation/pipeline.h"

namespace tandem::teleop {

/** State of a device at one time. Axes of the operator: x to the right, y up, z away from the operator. */
struct Reading {
  bool present = false;  ///< the dead-man switch is held
  bool clutch = false;
  bool pose = false;                                   ///< position and orientation are used, otherwise the velocities
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();    ///< m/s
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  std::uint32_t buttons = 0;
  // Requests, each reported once.
  int scale_steps = 0;     ///< up or down
  bool next_mode = false;  ///< tip, pair, relative, ...
  bool next_arm = false;
  bool stop = false;  ///< stop the robot
  bool end = false;   ///< end of the session
};

/** A device is missing or was disconnected; what() names it and the remedy. */
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/** One device. Used by one thread. */
class Device {
 public:
  virtual ~Device() = default;
  /// Reads the present state; does not wait. @param time  s since the device was opened
  /// @throw DeviceError if it was disconnected.
  virtual Reading read(double time) = 0;
  virtual planning::teleoperation::Device kind() const = 0;
  /// Name and controls of the device, for the operator.
  virtual std::string describe() const = 0;
  /// Shows whether a limit of the robot is active.
  virtual void showLimited(bool) {}
};

/// Default of --angular-speed, rad/s.
inline constexpr double kAngularSpeed = 0.5;

/// @param speed  of a fully deflected axis, m/s; @param angular_speed  the same of rotations, rad/s
/// @throw DeviceError if none is found.
std::unique_ptr<Device> openGamepad(double speed, double angular_speed = kAngularSpeed);
std::unique_ptr<Device> openSpaceMouse(double speed, double angular_speed = kAngularSpeed);
/// Keyboard of this process's terminal.
std::unique_ptr<Device> openKeyboard(double speed, double angular_speed = kAngularSpeed);
/// A CSV file, or an MCAP recording with teleop/input. @throw DeviceError that names file and line.
std::unique_ptr<Device> openTrace(const std::string& file);

}  // namespace tandem::teleop
