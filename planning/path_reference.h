// SPDX-License-Identifier: Apache-2.0
/** @file References of a path: desired pose and feed-forward twist in each control period. */
#pragma once

#include "planning/object_path.h"
#include "planning/reference.h"

namespace tandem::planning {

/// Desired pose of the object frame, robot base frame.
Eigen::Isometry3d poseOf(const ObjectReference& reference) noexcept;

/// Constant reference at a frame, in the components that a path tracks.
ObjectReference heldReference(const ObjectPath& path, const Eigen::Isometry3d& frame);

/// Reference of a path at a time, s; its feed-forward leads to the pose one period later.
/// @param start  the frame at the path's beginning, robot base frame
ObjectReference pathReference(const ObjectPath& path, const Eigen::Isometry3d& start, double time, double period);

/// Norm of the tracked components of the twist from one frame to another, m; radians count times the path's length.
double trackedError(const ObjectPath& path, const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

}  // namespace tandem::planning
