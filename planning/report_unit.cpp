// SPDX-License-Identifier: Apache-2.0
#include "planning/report_unit.h"

#include <numbers>

#include "kinematics/tasks/task_kind.h"

namespace tandem::planning {

ReportUnit reportUnit(idl::TaskKind kind) {
  const kinematics::TaskKindEntry* entry = kinematics::findTaskKind(kind);
  if (entry != nullptr && entry->unit == kinematics::TaskUnit::kNone)
    return {1.0, "stability"};
  return entry != nullptr && entry->unit == kinematics::TaskUnit::kRadian ? ReportUnit{180.0 / std::numbers::pi, "deg"}
                                                                          : ReportUnit{1e3, "mm"};
}

}  // namespace tandem::planning
