// SPDX-License-Identifier: Apache-2.0
#include "safety/gate.h"

#include <algorithm>
#include <cmath>

namespace tandem::safety {
namespace {

/// A smaller change is rounding, not an intervention. m, rad, m/s, rad/s.
constexpr double kSmallestAmount = 1e-12;
/// A command exactly at a speed limit passes: its speed was computed from a difference of positions.
constexpr double kSpeedTolerance = 1e-9;
constexpr double kRounding = 1e-15;
/// Passes over the rows before joints are stopped; neighbouring rows transfer a violation, which converges quickly.
constexpr int kRowPasses = 64;

/// Clamps a change to [-largest, largest] unless it is within the tolerance. Returns the amount removed.
double clampChange(double& change, double largest) noexcept {
  if (!(std::abs(change) > largest * (1.0 + kSpeedTolerance) + kRounding))
    return 0.0;
  const double before = change;
  change = std::clamp(change, -largest, largest);
  return std::abs(before - change);
}

/// Bound of a row for a step from `last`: an arm that starts outside is not driven farther out.
double stepBound(const LinearRow& row, const ArmVector& last) noexcept { return std::max(row.b, rowValue(row, last)); }

/// Amount by which joint j reduces the gap of the row from last to next; negative or zero if it opens the gap. m.
double closing(const LinearRow& row, const ArmVector& last, const ArmVector& next, Eigen::Index j) noexcept {
  return row.a[j] == 0.0 ? 0.0 : row.a[j] * (next[j] - last[j]);
}

/** Equation (1) joint by joint from the inside out: the outer joint of a violated row moves to the bound that the next
 * position of the inner one defines, less far or farther than commanded. Not done if it would move the outer joint
 * farther than the inner one moves, faster than its limit, or out of its box: then the row is relaxed instead. False:
 * nothing done. */
bool carryRow(const ArmLimits& limits,
              const LinearRow& row,
              double duration,
              const ArmVector& last,
              ArmVector& next) noexcept {
  if (rowValue(row, last) > row.b)
    return false;
  const double excess = rowValue(row, next) - row.b;
  if (!(excess > 0.0))
    return false;
  const int inner = row.inner_joint, outer = row.outer_joint;
  const double scale = std::max(std::abs(row.b), std::abs(row.a[inner] * next[inner]));
  const double edge = next[outer] - (excess + 1e-15 * scale) / row.a[outer];
  const JointLimit& joint = limits.joints[static_cast<std::size_t>(outer)];
  const double allowed = std::max(std::abs(next[inner] - last[inner]), std::abs(next[outer] - last[outer]));
  if (edge < joint.lower || edge > joint.upper || std::abs(edge - last[outer]) > allowed)
    return false;
  if (std::abs(edge - last[outer]) > joint.velocity * duration)
    return false;
  next[outer] = edge;
  return true;
}

/// Removes the excess of a row from the joints that cause it, in proportion to their share. False: no excess.
bool relaxRow(const LinearRow& row, const ArmVector& last, ArmVector& next) noexcept {
  const double bound = stepBound(row, last);
  const double excess = rowValue(row, next) - bound;
  if (!(excess > 0.0))
    return false;
  double total = 0.0;
  double scale = std::abs(bound);
  for (Eigen::Index j = 0; j < next.size(); ++j) {
    total += std::max(0.0, closing(row, last, next, j));
    if (row.a[j] != 0.0)
      scale = std::max(scale, std::abs(row.a[j] * next[j]));
  }
  // Slightly more than the excess, so that the rounded positions are inside.
  const double share = total > 0.0 ? (excess + 1e-15 * scale) / total : 1.0;
  for (Eigen::Index j = 0; j < next.size(); ++j) {
    if (closing(row, last, next, j) <= 0.0)
      continue;
    const double kept = last[j] + (next[j] - last[j]) * (1.0 - share);
    next[j] = share >= 1.0 ? last[j] : std::clamp(kept, std::min(last[j], next[j]), std::max(last[j], next[j]));
  }
  return true;
}

/// Keeps the closing joints of a row at their last position. The sum is monotone in every joint, so this satisfies the
/// row. False: no joint changed.
bool holdRow(const LinearRow& row, const ArmVector& last, ArmVector& next) noexcept {
  if (!(rowValue(row, next) > stepBound(row, last)))
    return false;
  bool held = false;
  for (Eigen::Index j = 0; j < next.size(); ++j) {
    if (closing(row, last, next, j) <= 0.0)
      continue;
    next[j] = last[j];
    held = true;
  }
  return held;
}

/// The first joint with a value that is not finite, or `size` if all are finite.
int firstNotFinite(const ArmVector& values, int size) noexcept {
  if (values.size() != size)
    return 0;
  int j = 0;
  while (j < size && std::isfinite(values[j]))
    ++j;
  return j;
}

}  // namespace

void GateReport::note(Guard guard, double amount, int joint) noexcept {
  GuardAction& action = guards[static_cast<std::size_t>(guard)];
  if (!action.acted || amount > action.amount) {
    action.amount = amount;
    action.joint = joint;
  }
  action.acted = true;
}

void Gate::checkIntegrity(const GateCommand& command, const ArmVector& last, GateReport& report) const noexcept {
  const auto refuse = [&report](Fault fault, Guard guard, double amount, int joint) {
    report.faults |= bit(fault);
    report.note(guard, amount, joint);
  };
  if (command.stream & bit(Fault::kStaleCommand))
    refuse(Fault::kStaleCommand, Guard::kFresh, command.age_excess, 0);
  if (command.stream & bit(Fault::kOutOfSequence))
    refuse(Fault::kOutOfSequence, Guard::kSequence, 1.0, 0);
  if (command.stream & bit(Fault::kUnknownArm))
    refuse(Fault::kUnknownArm, Guard::kKnownArm, 1.0, 0);
  if (report.faults != 0)
    return;  // the values of such a command are irrelevant
  const int n = limits_.jointCount();
  const int bad = std::min(firstNotFinite(command.position, n), firstNotFinite(command.velocity, n));
  if (bad < n || !std::isfinite(command.duration) || command.duration <= 0.0) {
    refuse(Fault::kNotFinite, Guard::kFinite, 1.0, bad < n ? bad : 0);
    return;
  }
  for (int j = 0; j < n; ++j) {
    const double excess = std::abs(command.position[j] - last[j]) - limits_.joints[j].max_step;
    if (excess > kSmallestAmount)
      refuse(Fault::kStepTooLarge, Guard::kStep, excess, j);
  }
}

void Gate::limitSpeed(double duration,
                      const ArmVector& last,
                      const ArmVector& last_velocity,
                      ArmVector& next,
                      GateReport& report) const noexcept {
  for (int j = 0; j < limits_.jointCount(); ++j) {
    const JointLimit& joint = limits_.joints[j];
    double change = next[j] - last[j];
    // Slew: difference from the change at the last velocity.
    const double going_on = last_velocity[j] * duration;
    double turn = change - going_on;
    const double by_slew = clampChange(turn, joint.slew_limit * duration * duration);
    if (by_slew > 0.0) {
      change = going_on + turn;
      next[j] = last[j] + change;
      if (by_slew > kSmallestAmount)
        report.note(Guard::kSlew, by_slew / duration, j);
    }
    const double by_velocity = clampChange(change, joint.velocity * duration);
    if (by_velocity > 0.0) {
      next[j] = last[j] + change;
      if (by_velocity > kSmallestAmount)
        report.note(Guard::kVelocity, by_velocity / duration, j);
    }
  }
}

void Gate::limitPosition(const ArmVector& last, ArmVector& next, GateReport& report) const noexcept {
  for (int j = 0; j < limits_.jointCount(); ++j) {
    const JointLimit& joint = limits_.joints[j];
    const double inside = std::clamp(next[j], std::min(joint.lower, last[j]), std::max(joint.upper, last[j]));
    const double amount = std::abs(next[j] - inside);
    if (amount > kSmallestAmount)
      report.note(Guard::kPosition, amount, j);
    next[j] = inside;
  }
}

void Gate::limitRows(double duration, const ArmVector& last, ArmVector& next, GateReport& report) const noexcept {
  const ArmVector before = next;
  for (const LinearRow& row : limits_.rows)
    carryRow(limits_, row, duration, last, next);
  bool changed = true;
  for (int pass = 0; changed && pass < kRowPasses; ++pass) {
    changed = false;
    for (const LinearRow& row : limits_.rows)
      changed = relaxRow(row, last, next) || changed;
  }
  // Each round that changes anything stops one more joint, so this terminates.
  while (changed) {
    changed = false;
    for (const LinearRow& row : limits_.rows)
      changed = holdRow(row, last, next) || changed;
  }
  for (int j = 0; j < limits_.jointCount(); ++j) {
    const double amount = std::abs(before[j] - next[j]);
    if (amount > kSmallestAmount)
      report.note(Guard::kCoupledRow, amount, j);
  }
}

GateReport Gate::check(const GateCommand& command,
                       const ArmVector& last_setpoint,
                       const ArmVector& last_velocity,
                       ArmVector& setpoint) const noexcept {
  GateReport report;
  checkIntegrity(command, last_setpoint, report);
  if (report.faults != 0) {
    setpoint = last_setpoint;
    return report;
  }
  setpoint = command.position;
  limitSpeed(command.duration, last_setpoint, last_velocity, setpoint, report);
  limitPosition(last_setpoint, setpoint, report);
  limitRows(command.duration, last_setpoint, setpoint, report);
  return report;
}

void GuardCounters::add(int arm, const GateReport& report) noexcept {
  for (int g = 0; g < kGuardCount; ++g) {
    const GuardAction& action = report.guards[g];
    if (!action.acted)
      continue;
    Entry& entry = entries_[g];
    ++entry.count;
    entry.largest = std::max(entry.largest, action.amount);
    entry.arm = arm;
    entry.joint = action.joint;
  }
}

}  // namespace tandem::safety
