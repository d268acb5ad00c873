// SPDX-License-Identifier: Apache-2.0
/** @file Pose of the grasped object, computed from the tip poses. */
#pragma once

#include <vector>

#include "config/cooperative.h"

namespace tandem::console {

/** The object that tips touch: a grip turns it with the tip; of contacts that turn, the line from the first to the
 * second one says how it lies. The console's `scene/object.ts` does the same.
 * @param tips  of the contacts' arms, in the order of the contacts, robot base frame
 * @return robot base frame <- object */
Eigen::Isometry3d objectPose(const config::GraspedObject& object, const std::vector<Eigen::Isometry3d>& tips);

}  // namespace tandem::console
