// SPDX-License-Identifier: Apache-2.0
#include "safety/recovery.h"

#include <algorithm>

#include "safety/joint_motion.h"

namespace tandem::safety {
namespace {

/// Distance that these joints may retract together up to a box or a row, m; negative outside.
double roomBehind(const ArmLimits& limits, const ArmVector& q, int first, int last) noexcept {
  double room = kUnlimited;
  for (int j = first; j <= last; ++j)
    room = std::min(room, q[j] - limits.joints[static_cast<std::size_t>(j)].lower);
  for (const LinearRow& row : limits.rows) {
    const double closing = -row.a.segment(first, last - first + 1).sum();
    if (closing > 0.0)
      room = std::min(room, (row.b - rowValue(row, q)) / closing);
  }
  return room;
}

}  // namespace

double recoveryVelocity(const ArmLimits& limits, JointMask lost, int joint) noexcept {
  if ((lost & jointBit(joint)) != 0)
    return 0.0;
  const double slow = limits.isTranslation(joint) ? kRecoveryTranslation : kRecoveryRotation;
  return std::min(slow, moveVelocity(limits, joint));
}

Withdrawal nextWithdrawal(const ArmLimits& limits, const ArmVector& q, JointMask lost, double step) noexcept {
  Withdrawal next;
  const auto retracts = [&limits](int joint) { return joint < limits.jointCount() && limits.isTranslation(joint); };
  for (int first = 0; retracts(first); ++first) {
    next.joints = 0;
    for (int last = first; retracts(last) && (lost & jointBit(last)) == 0; ++last) {
      next.joints |= jointBit(last);
      const double room = roomBehind(limits, q, first, last);
      next.distance = std::min(step, room);
      if (room > kPositionTolerance)
        return next;
    }
  }
  return {};
}

}  // namespace tandem::safety
