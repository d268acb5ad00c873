// SPDX-License-Identifier: Apache-2.0
#include "config/detail/hardware_homing.h"

#include <algorithm>

#include "config/detail/exact.h"
#include "hal/drives/homing_methods.h"

namespace tandem::config {
namespace {

using hal::AxisConfig;

using hal::PositionReference;

bool hasStop(const AxisConfig& axis) { return axis.reference == PositionReference::kHardStop; }

/// Speed of the search, m/s; 0: the axis does not move.
double searchSpeed(const AxisConfig& axis) {
  const hal::HomingConfig& homing = axis.homing;
  return hasStop(axis)                            ? axis.hard_stop.speed
         : hal::homesWithoutMotion(homing.method) ? 0.0
         : hal::homesToIndexAlone(homing.method)  ? homing.slow
                                                  : homing.fast;
}

/// A run against a stop starts with the axis' own ramps.
double searchAcceleration(const AxisConfig& axis) { return hasStop(axis) ? 0.0 : axis.homing.acceleration; }

/// Equal reference and order; equal speed and acceleration if both move.
bool together(const AxisConfig& a, const AxisConfig& b) {
  if (a.needsRun() != b.needsRun())
    return false;
  if (!a.needsRun())
    return true;
  const double first = searchSpeed(a), second = searchSpeed(b);
  const bool both = first != 0.0 && second != 0.0;
  return a.homing.order == b.homing.order &&
         (!both || (first == second && searchAcceleration(a) == searchAcceleration(b)));
}

void checkCarriages(const Map& map, const hal::ArmConfig& arm, const std::vector<const AxisConfig*>& carriages) {
  safety::ArmVector home;
  home.setZero(arm.limits.jointCount());
  for (const AxisConfig* axis : carriages) {
    home[axis->joint] = axis->homing.position;
    for (const AxisConfig* other : carriages) {
      if (!together(*axis, *other))
        map.fail("translations", "found linear stages of " + arm.name +
                                     " with different homing settings, expected equal reference, order, speed "
                                     "and acceleration: equation (1) couples them");
    }
    if (!hasStop(*axis) && axis->needsRun() && carriages.size() > 1 && !arm.limits.rows.empty() &&
        hal::homingTurnsAround(axis->homing.method))
      map.fail("translations", "found homing method " + std::to_string(axis->homing.method) + " for " + axis->name +
                                   ", which may turn around at a limit switch while another carriage moves on; "
                                   "expected 1 to 6, 17 to 22, 33, 34, 35 or 37, because equation (1) couples them");
  }
  if (carriages.empty() || !carriages.front()->needsRun())
    return;
  for (const safety::LinearRow& row : arm.limits.rows) {
    if (safety::rowValue(row, home) > row.b + 1e-9)
      map.fail("translations",
               "found home positions of " + arm.name + " that break equation (1): " + safety::describe(row));
  }
}

}  // namespace

namespace {

/// Behaviour of the drive in a homing method of its manufacturer, which only its profile describes.
void readVendorMethod(const Map& map, const std::vector<VendorHoming>& methods, hal::HomingConfig& homing) {
  std::string known;
  for (const VendorHoming& one : methods) {
    if (one.method == homing.method) {
      homing.stop = one.positive ? 1 : -1;
      homing.stop_index = one.index;
      return;
    }
    known += (known.empty() ? "" : ", ") + std::to_string(one.method);
  }
  map.fail("method", "found " + std::to_string(homing.method) +
                         ", a number of the manufacturer, expected one that the `profile` of the drive names in "
                         "`homing_methods`: " +
                         (known.empty() ? "it names none" : known));
}

void checkHomingRun(const Map& map, const std::vector<VendorHoming>& methods, AxisConfig& axis) {
  if (axis.homing.method < 0)
    readVendorMethod(map, methods, axis.homing);
  if (hal::isReservedHomingMethod(axis.homing.method))
    map.fail("method", "found " + std::to_string(axis.homing.method) +
                           ", which CiA 402-2 reserves, expected 1 to 14, 17 to 30, 33, 34, 35 or 37, or a negative "
                           "number of the manufacturer that the `profile` of the drive names");
  for (const char* key : {"fast", "slow"}) {
    if (const double speed = map.number(key); speed > axis.velocity)
      map.fail(
          key,
          "found " + exact(speed / axis.velocity) +
              " times `velocity` of the drive, expected at most `velocity`: since 22 November 2026 homing runs go no "
              "faster than the axis. Lower this speed, or raise `velocity` to what the axis can do");
  }
}

void readHardStop(const Map& map, AxisConfig& axis) {
  map.read(axis);
  axis.hard_stop.torque = 1e-3 * map.number("torque_per_mille");
  if (axis.hard_stop.speed > axis.velocity)
    map.fail("speed", "found " + exact(axis.hard_stop.speed / axis.velocity) +
                          " times `velocity` of the drive, expected at most `velocity`");
  if (const double most = 0.5 * axis.following_error / axis.hard_stop.time; axis.hard_stop.speed > most)
    map.fail("speed", "found " + map.inUnit("speed", axis.hard_stop.speed) + ", expected at most " +
                          map.inUnit("speed", most) +
                          ": in `time`, half of `following_error`, so that the drive finds no following error at its "
                          "stop");
}

}  // namespace

void readReference(const Map& drive, const std::vector<VendorHoming>& methods, AxisConfig& axis) {
  constexpr std::uint16_t kTorqueActual = 0x6077;
  const std::pair<const char*, PositionReference> runs[] = {{"homing", PositionReference::kHoming},
                                                            {"hard_stop", PositionReference::kHardStop}};
  for (const auto& [key, reference] : runs) {
    const std::string name = key;
    if (!drive.has(name) && axis.reference == reference)
      drive.fail("reference", "found " + name + ", expected a `" + name + "` mapping together with it");
    if (drive.has(name) && axis.reference != reference)
      drive.fail(name, "found a homing run, expected `reference: " + name + "` together with it");
  }
  if (drive.has("homing"))
    checkHomingRun(drive.map("homing"), methods, axis);
  if (hasStop(axis))
    readHardStop(drive.map("hard_stop"), axis);
  if (hasStop(axis) && axis.torque.object != 0 && axis.torque.object != kTorqueActual)
    drive.fail("torque_limit",
               "found `object: current`, expected `torque` with `reference: hard_stop`, whose run "
               "reads the torque");
  if (axis.jump_tolerance > 0.0 && axis.needsRun())
    drive.fail("jump_tolerance", "found one with a reference by " +
                                     std::string(hasStop(axis) ? "hard_stop" : "homing") +
                                     ", expected `reference: absolute_encoder`, `drive` or `measured`");
}

void checkHomingTogether(const Map& map, const hal::HardwareConfig& hardware) {
  for (std::size_t a = 0; a < hardware.arms.size(); ++a) {
    std::vector<const AxisConfig*> carriages;
    for (const AxisConfig& axis : hardware.axes) {
      if (axis.arm == static_cast<int>(a) && axis.translation)
        carriages.push_back(&axis);
    }
    checkCarriages(map, hardware.arms[a], carriages);
  }
}

}  // namespace tandem::config
