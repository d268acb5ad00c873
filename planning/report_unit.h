// SPDX-License-Identifier: Apache-2.0
/** @file Units of the errors of tasks in texts and reports. */
#pragma once

#include "idl/enumerations.h"

namespace tandem::planning {

/** Unit in which reports state the errors of a kind. */
struct ReportUnit {
  double per_si;     ///< of it per m, rad or 1
  const char* name;  ///< "mm", "deg", "stability"
};
/// @param kind  one that is unknown has mm
ReportUnit reportUnit(idl::TaskKind kind);

}  // namespace tandem::planning
