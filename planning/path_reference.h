// SPDX-License-Identifier: Apache-2.0
/** @file References of a path: desired pose and feed-forward twist in each control period. */
#pragma once

#include "planning/object_path.h"
#include "planning/reference.h"

namespace tandem::planning {

/// Where a reference asks the frame to be, robot base frame.
Eigen::Isometry3d poseOf(const ObjectReference& reference) noexcept;

/// Holds a frame where it is, in the components that a path tracks.
ObjectReference heldReference(const ObjectPath& path, const Eigen::Isometry3d& frame);

/// Where a path is at a time, s; its feed-forward leads to where it is a period later.
/// @param start  the frame at the path's beginning, robot base frame
ObjectReference pathReference(const ObjectPath& path, const Eigen::Isometry3d& start, double time, double period);

/// |.| of the tracked components of what leads from one frame to another, m; radians count the path's length.
double trackedError(const ObjectPath& path, const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

}  // namespace tandem::planning
