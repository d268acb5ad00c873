// SPDX-License-Identifier: Apache-2.0
/** @file Setpoint gate of one arm: the last check before the drives.
 *
 * Integrity guards (finite, fresh, in sequence, step size, known arm) refuse the command; the caller stops the arm and
 * latches the fault. Limit guards (slew, velocity, position, coupled rows; in this order, so that position has the last
 * word) saturate joint by joint and say which guard acted, on which joint and by how much. Nothing is clamped in
 * silence. */
#pragma once

#include <array>
#include <cstdint>

#include "safety/faults.h"
#include "safety/limits.h"

namespace tandem::safety {

/** A command for one arm, as it reaches the gate. */
struct GateCommand {
  FaultMask stream = 0;     ///< what CommandMonitor found against the command
  double age_excess = 0.0;  ///< by how much it is too old, s
  ArmVector velocity;       ///< over the next period, m/s, rad/s; must be finite
  ArmVector position;       ///< setpoint at the end of that period, m, rad
  double duration = 0.0;    ///< that period, s
};

/** What one guard did to one command. */
struct GuardAction {
  bool acted = false;
  double amount = 0.0;  ///< largest over the joints: m, rad, m/s, rad/s; s for kFresh
  int joint = 0;        ///< the joint with that amount
};

/** What the gate did to one command. */
struct GateReport {
  FaultMask faults = 0;  ///< not 0: refused
  std::array<GuardAction, kGuardCount> guards{};

  const GuardAction& operator[](Guard guard) const { return guards[static_cast<std::size_t>(guard)]; }
  /// Notes an action of a guard; keeps the largest amount.
  void note(Guard guard, double amount, int joint) noexcept;
};

/** Gate of one arm. Allocates only when it is made. */
class Gate {
 public:
  explicit Gate(ArmLimits limits) : limits_(std::move(limits)) {}

  const ArmLimits& limits() const noexcept { return limits_; }
  /// From now on joint j is no faster than that, m/s or rad/s.
  void setVelocity(int joint, double velocity) noexcept {
    limits_.joints[static_cast<std::size_t>(joint)].velocity = velocity;
  }

  /** Checks a command against the last setpoint that went past the gate.
   *
   * @param last_setpoint m, rad; @param last_velocity commanded over the last period, m/s, rad/s
   * @param[out] setpoint the saturated position, inside boxes and rows where last_setpoint was inside them, and
   *   otherwise no farther out; last_setpoint where the command is refused. With the slew guard idle, each joint stays
   *   between last_setpoint and the position that was asked for, except for a carriage that its inner neighbour runs
   * into: that one is carried along, no farther than the neighbour goes. Holding the neighbour back instead would end
   * in a deadlock where a controller knows equation (1) only as printed, tube i bounded by tube i-1 alone. */
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

/** Counts what the guards of a robot did since the start. */
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
