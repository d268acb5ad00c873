// SPDX-License-Identifier: Apache-2.0
/** @file Setpoint gate of one arm: the last check before the drives.
 *
 * Integrity guards (finite, fresh, in sequence, step size, known arm) refuse the command; the caller stops the arm and
 * latches the fault. Limit guards (slew, velocity, position, coupled rows; in this order, so that position has
 * precedence over the rates) saturate joint by joint and report which guard acted, on which joint and by how much.
 * Every clamp is reported. */
#pragma once

#include <array>
#include <cstdint>

#include "safety/faults.h"
#include "safety/limits.h"

namespace tandem::safety {

/** Command for one arm at the input of the gate. */
struct GateCommand {
  FaultMask stream = 0;     ///< faults that CommandMonitor found in the command
  double age_excess = 0.0;  ///< time by which it exceeds the age budget, s
  ArmVector velocity;       ///< over the next period, m/s, rad/s; must be finite
  ArmVector position;       ///< setpoint at the end of that period, m, rad
  double duration = 0.0;    ///< length of that period, s
};

/** Action of one guard on one command. */
struct GuardAction {
  bool acted = false;
  double amount = 0.0;  ///< largest over the joints: m, rad, m/s, rad/s; s for kFresh
  int joint = 0;        ///< the joint with that amount
};

/** Result of the gate for one command. */
struct GateReport {
  FaultMask faults = 0;  ///< not 0: the command is refused
  std::array<GuardAction, kGuardCount> guards{};

  const GuardAction& operator[](Guard guard) const { return guards[static_cast<std::size_t>(guard)]; }
  /// Records an action of a guard; keeps the largest amount.
  void note(Guard guard, double amount, int joint) noexcept;
};

/** Gate of one arm. Allocates only in its constructor. */
class Gate {
 public:
  explicit Gate(ArmLimits limits) : limits_(std::move(limits)) {}

  const ArmLimits& limits() const noexcept { return limits_; }
  /// Sets the velocity limit of joint j, m/s or rad/s.
  void setVelocity(int joint, double velocity) noexcept {
    limits_.joints[static_cast<std::size_t>(joint)].velocity = velocity;
  }

  /** Checks a command against the last setpoint that passed the gate.
   *
   * @param last_setpoint m, rad; @param last_velocity commanded over the last period, m/s, rad/s
   * @param[out] setpoint the saturated position, inside boxes and rows where last_setpoint was inside them, otherwise
   * no farther out; last_setpoint if the command is refused. With the slew guard inactive, each joint stays between
   * last_setpoint and the commanded position, except an outer carriage that its inner neighbour runs into: the gate
   * moves it along, no farther than the neighbour moves. Stopping the neighbour instead would deadlock a controller
   * that applies equation (1) only as printed (tube i bounded by tube i-1 alone). */
  GateReport check(const GateCommand& command,
                   const ArmVector& last_setpoint,
                   const ArmVector& last_velocity,
                   ArmVector& setpoint) const noexcept;

 private:
  void checkIntegrity(const GateCommand& command, const ArmVector& last, GateReport& report) const noexcept;
  void limitSpeed(double duration,
                  const ArmVector& last,
                  const ArmVector& last_velocity,
                  ArmVector& next,
                  GateReport& report) const noexcept;
  void limitPosition(const ArmVector& last, ArmVector& next, GateReport& report) const noexcept;
  void limitRows(double duration, const ArmVector& last, ArmVector& next, GateReport& report) const noexcept;

  ArmLimits limits_;
};

/** Counters of guard actions of one robot since the start. */
class GuardCounters {
 public:
  struct Entry {
    std::uint64_t count = 0;  ///< commands on which the guard acted, per arm
    double largest = 0.0;     ///< largest amount
    int arm = 0;              ///< of the last action
    int joint = 0;            ///< of the last action
  };
  void add(int arm, const GateReport& report) noexcept;
  const Entry& operator[](Guard guard) const { return entries_[static_cast<std::size_t>(guard)]; }

 private:
  std::array<Entry, kGuardCount> entries_{};
};

}  // namespace tandem::safety
