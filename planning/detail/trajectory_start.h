// SPDX-License-Identifier: Apache-2.0
/** @file The start of a trajectory: checked before its points. */
#pragma once

#include <string>
#include <vector>

#include "planning/inverse_kinematics.h"

namespace tandem::planning {

/** The start: tips, equilibria, and the reason if it is not permitted. */
struct Start {
  std::vector<kinematics::Tip> tips;
  std::vector<kinematics::Branch> branches;
  std::string wrong;
};

/// Number of joints, equilibria, limits and stability at the joints of all arms.
Start lookAt(const Arms& arms, const safety::RobotVector& q, const Demands& demands);

/** Demand that the arms cannot meet at the tips of the start, neither at its joints nor near them; empty: none.
 * @param targets  tips of the start  @param judge  accepts the joints as they are  @param near  searches near them */
std::string unmetAtStart(const Arms& arms,
                         const std::vector<TipTarget>& targets,
                         const safety::RobotVector& q,
                         const std::vector<kinematics::Branch>& branches,
                         const InverseKinematics& judge,
                         const InverseKinematics& near,
                         const Demands& demands);

}  // namespace tandem::planning
