// SPDX-License-Identifier: Apache-2.0
/** @file What operators send and see. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "safety/dimensions.h"

namespace tandem::dds {

/// ControlStatus::lease_holder while CRTK clients, which have no identity, command.
inline constexpr std::uint64_t kCrtkClient = std::numeric_limits<std::uint64_t>::max();

/// Who moves the robot. ControlStatus::source
enum class Source : std::uint8_t { kNobody = 0, kPlanning, kTeleoperation, kCrtk, kJoints };

/// teleop/input, operators' clients -> control. tandem_msgs/TeleopInput
struct TeleopInput {
  std::uint64_t client = 0;
  std::uint64_t sequence = 0;
  std::uint64_t control_session = 0;
  std::uint64_t answers_control = 0;  ///< sequence of the last control/status seen: freshness on control's own clock
  std::int64_t stamp = 0;             ///< ns, when the device was read
  std::uint8_t device = 0;            ///< planning::teleoperation::Device
  std::uint8_t operator_present = 0;  ///< 1: the dead-man switch is held
  std::uint8_t clutch = 0;            ///< 1: the device moves freely, the robot stays
  std::uint8_t mode = 0;              ///< planning::teleoperation::Mode
  std::uint8_t arm = 0;               ///< that is driven
  std::uint8_t other_arm = 0;         ///< its partner; equal to arm: there is none
  std::uint8_t kind = 0;              ///< 1 velocity of the device, 2 pose of the device in its own frame
  std::uint8_t frame = 0;             ///< 0 axes of the robot's base frame, 1 of the view
  std::array<double, 4> view{0, 0, 0, 1};         ///< from the view's axes to the base frame's, x y z w
  std::array<double, 3> linear{};                 ///< m/s before scaling
  std::array<double, 3> angular{};                ///< rad/s; not followed
  std::array<double, 3> position{};               ///< m
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< x y z w; not followed
  double scale = 0.0;                             ///< 0.05 to 1; 0: the deployment's
  std::uint32_t buttons = 0;
};

/// teleop/status: one stage of the way from the device to the robot. tandem_msgs/TeleopStage
struct TeleopStage {
  std::string name;
  std::uint8_t active = 0;        ///< 1: it changes what comes in
  std::string limited_by;         ///< what in it does; empty where nothing does
  std::array<double, 3> input{};  ///< m/s up to the scale; m, robot base frame, from the filter on
  std::array<double, 3> output{};
};

/// teleop/status, control -> all. tandem_msgs/TeleopStatus
struct TeleopStatus {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::uint64_t answers_state = 0;
  std::int64_t stamp = 0;
  std::uint8_t state = 0;  ///< planning::teleoperation::State
  std::string reason;
  std::uint64_t client = 0;
  std::uint64_t answers_input = 0;
  std::uint8_t device = 0, operator_present = 0, clutch = 0, mode = 0, arm = 0, other_arm = 0, frame = 0;
  double scale = 0.0;        ///< in force
  double input_age = 0.0;    ///< s
  double latency = 0.0;      ///< s, there and back
  double input_rate = 0.0;   ///< 1/s
  double tip_latency = 0.0;  ///< s
  std::uint64_t accepted = 0, refused = 0, late = 0;
  std::uint64_t refused_client = 0;
  std::string refusal;
  std::vector<TeleopStage> stages;
  std::array<double, 3> wanted{};                         ///< m, robot base frame
  std::array<double, 3> target{};                         ///< m
  std::array<double, 3> position{};                       ///< m
  std::array<double, 3 * safety::kMaxArms> tip_target{};  ///< x y z of each arm, m
  std::uint8_t clamped = 0;
  std::string limited_by;
};

/// crtk/status: one command topic. tandem_msgs/CrtkCommand
struct CrtkCommand {
  std::string name;
  std::uint8_t active = 0;
  std::uint64_t accepted = 0, refused = 0;
  std::string refusal;
};

/// crtk/status, control -> all. tandem_msgs/CrtkStatus
struct CrtkStatus {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::int64_t stamp = 0;
  std::uint8_t commanding = 0;
  std::string stamps;  ///< "wall" or "arrival"
  std::vector<CrtkCommand> commands;
};

}  // namespace tandem::dds
