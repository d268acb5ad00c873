// SPDX-License-Identifier: Apache-2.0
/** @file Drive side: common interface of the real drives of hal and the simulated drives of sim. */
#pragma once

#include <concepts>
#include <cstdint>

#include "safety/emergency_stop.h"
#include "safety/gate.h"
#include "safety/robot_command.h"

namespace tandem::runtime {

/** The drives of all arms, on buses (hal::RobotHardware) or simulated (sim::SimulatedDrives). Times are ns on one
 * clock; m, rad, s. */
// clang-format off
template <class T>
concept DriveSide = requires(T drives, const T seen, const safety::RobotCommand command, std::int64_t now, int arm) {
  // command() returns false if an integrity guard refuses the whole stream.
  { drives.command(command, now) } noexcept -> std::same_as<bool>;
  { drives.stop() } noexcept;
  { drives.stopPowered(safety::FaultRecord{}) } noexcept;

  { seen.armCount() } noexcept -> std::same_as<int>;
  { seen.answersCommand() } noexcept -> std::same_as<std::uint64_t>;
  { seen.commandSuccess() } noexcept -> std::same_as<double>;
  { seen.jointResets() } noexcept -> std::same_as<std::uint32_t>;
  { seen.emergencyStop() } noexcept -> std::same_as<safety::EmergencyStop>;
  { seen.guards() } noexcept -> std::same_as<const safety::GuardCounters&>;

  { seen.jointCount(arm) } noexcept -> std::same_as<int>;
  { seen.position(arm) } noexcept -> std::same_as<safety::ArmVector>;
  { seen.velocity(arm) } noexcept -> std::same_as<safety::ArmVector>;
  { seen.setpoint(arm) } noexcept -> std::same_as<const safety::ArmVector&>;
  { seen.valid(arm) } noexcept -> std::same_as<bool>;
  { seen.homed(arm) } noexcept -> std::same_as<bool>;
  { seen.holdsWithoutPower(arm) } noexcept -> std::same_as<bool>;
  { seen.state(arm) } noexcept -> std::same_as<safety::OperatingState>;
  { seen.faults(arm) } noexcept -> std::same_as<safety::FaultMask>;
  { seen.faultRecord(arm) } noexcept -> std::same_as<const safety::FaultRecord&>;
  { seen.recovering(arm) } noexcept -> std::same_as<bool>;
  { seen.lost(arm) } noexcept -> std::same_as<safety::JointMask>;
};
// clang-format on

}  // namespace tandem::runtime
