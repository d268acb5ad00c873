// SPDX-License-Identifier: Apache-2.0
/** @file Pose of the grasped object, computed from the tip poses. */
#pragma once

#include <vector>

#include "config/cooperative.h"

namespace tandem::console {

/** The grasped object. A rigid contact turns it with the tip; with contacts that allow rotation, the line from the
 * first to the second one gives its orientation. The console's `scene/object.ts` uses the same computation.
 * @param tips  of the contacts' arms, in the order of the contacts, robot base frame
 * @return robot base frame <- object */
Eigen::Isometry3d objectPose(const config::GraspedObject& object, const std::vector<Eigen::Isometry3d>& tips);

}  // namespace tandem::console
