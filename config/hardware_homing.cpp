// SPDX-License-Identifier: Apache-2.0
#include "config/detail/hardware_homing.h"

#include <algorithm>

#include "config/detail/exact.h"
#include "hal/drives/homing_methods.h"

namespace tandem::config {
namespace {

using hal::AxisConfig;

bool homes(const AxisConfig& axis) { return axis.reference == hal::PositionReference::kHoming; }

/// Speed of the search, m/s; 0: the axis does not move.
double searchSpeed(const hal::HomingConfig& homing) {
  return hal::homesWithoutMotion(homing.method)  ? 0.0
         : hal::homesToIndexAlone(homing.method) ? homing.slow
                                                 : homing.fast;
}

/// Equal reference and order; equal speed and acceleration if both move.
bool together(const AxisConfig& a, const AxisConfig& b) {
  if (homes(a) != homes(b))
    return false;
  if (!homes(a))
    return true;
  const double first = searchSpeed(a.homing), second = searchSpeed(b.homing);
  const bool both = first != 0.0 && second != 0.0;
  return a.homing.order == b.homing.order &&
         (!both || (first == second && a.homing.acceleration == b.homing.acceleration));
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
    if (homes(*axis) && carriages.size() > 1 && !arm.limits.rows.empty() && hal::homingTurnsAround(axis->homing.method))
      map.fail("translations", "found homing method " + std::to_string(axis->homing.method) + " for " + axis->name +
                                   ", which may turn around at a limit switch while another carriage moves on; "
                                   "expected 1 to 6, 17 to 22, 33, 34, 35 or 37, because equation (1) couples them");
  }
  if (carriages.empty() || !homes(*carriages.front()))
    return;
  for (const safety::LinearRow& row : arm.limits.rows) {
    if (safety::rowValue(row, home) > row.b + 1e-9)
      map.fail("translations",
               "found home positions of " + arm.name + " that break equation (1): " + safety::describe(row));
  }
}

}  // namespace

void checkHomingRun(const Map& drive, const AxisConfig& axis) {
  if (!drive.has("homing")) {
    if (homes(axis))
      drive.fail("reference", "found homing, expected a `homing` mapping together with it");
    return;
  }
  if (!homes(axis))
    drive.fail("homing", "found a homing run, expected `reference: homing` together with it");
  const Map map = drive.map("homing");
  if (hal::isReservedHomingMethod(axis.homing.method))
    map.fail("method", "found " + std::to_string(axis.homing.method) +
                           ", which CiA 402-2 reserves, expected 1 to 14, 17 to 30, 33, 34, 35 or 37, or a negative "
                           "number of the manufacturer");
  for (const char* key : {"fast", "slow"}) {
    if (const double speed = map.number(key); speed > axis.velocity)
      map.fail(
          key,
          "found " + exact(speed / axis.velocity) +
              " times `velocity` of the drive, expected at most `velocity`: since 22 November 2026 homing runs go no "
              "faster than the axis. Lower this speed, or raise `velocity` to what the axis can do");
  }
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
