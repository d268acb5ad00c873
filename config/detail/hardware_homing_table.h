// SPDX-License-Identifier: Apache-2.0
/** @file Tables of the keys of homing runs in hardware files. */
#pragma once

#include "config/file_tables.h"

namespace tandem::config {

/** Selects names, quantities and texts of a table: linear stages or rotations. */
struct JointKind {
  bool translation;
  const char* name() const { return translation ? "translation" : "rotation"; }
  std::string prefixed(const std::string& what) const { return std::string(name()) + "_" + what; }
  Quantity position() const { return translation ? Quantity::kLength : Quantity::kAngle; }
  Quantity speed() const { return translation ? Quantity::kSpeed : Quantity::kAngularSpeed; }
  Quantity acceleration() const { return translation ? Quantity::kAcceleration : Quantity::kAngularAcceleration; }
};

/// `homing`: a homing run of the drive.
Mapping homingMapping(JointKind kind);
/// `hard_stop`: a run against a mechanical stop. Its fields fill an AxisConfig.
Mapping hardStopMapping(JointKind kind);

}  // namespace tandem::config
