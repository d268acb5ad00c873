// SPDX-License-Identifier: Apache-2.0
#include "planning/path_reference.h"

#include <cmath>

namespace tandem::planning {
namespace {

Eigen::Isometry3d frameAt(const ObjectPath& path, const Eigen::Isometry3d& start, double time) {
  Twist displacement, rate;
  path.at(time, displacement, rate);
  return displaced(start, displacement);
}

}  // namespace

Eigen::Isometry3d poseOf(const ObjectReference& reference) noexcept {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = reference.position;
  pose.linear() = reference.orientation.toRotationMatrix();
  return pose;
}

ObjectReference heldReference(const ObjectPath& path, const Eigen::Isometry3d& frame) {
  ObjectReference reference;
  reference.position = frame.translation();
  reference.orientation = Eigen::Quaterniond(frame.linear()).normalized();
  for (const int k : path.tracked())
    reference.tracked[static_cast<std::size_t>(k)] = true;
  return reference;
}

ObjectReference pathReference(const ObjectPath& path, const Eigen::Isometry3d& start, double time, double period) {
  const Eigen::Isometry3d now = frameAt(path, start, time);
  ObjectReference reference = heldReference(path, now);
  reference.feed_forward = difference(now, frameAt(path, start, time + period)) / period;
  return reference;
}

double trackedError(const ObjectPath& path, const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  const Twist error = difference(from, to);
  double squares = 0.0;
  for (const int k : path.tracked()) {
    const double own = (k < 3 ? 1.0 : path.length) * error[k];
    squares += own * own;
  }
  return std::sqrt(squares);
}

}  // namespace tandem::planning
