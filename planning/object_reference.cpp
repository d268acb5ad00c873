// SPDX-License-Identifier: Apache-2.0
#include "planning/reference.h"

namespace tandem::planning {

ObjectReference ObjectReference::after(double time) const noexcept {
  ObjectReference later = *this;
  later.position += time * feed_forward.head<3>();
  const Eigen::Vector3d turn = time * feed_forward.tail<3>();
  if (const double angle = turn.norm(); angle > 0.0)
    later.orientation = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * orientation).normalized();
  return later;
}

}  // namespace tandem::planning
