// SPDX-License-Identifier: Apache-2.0
#include "config/translation_room.h"

#include <algorithm>

namespace tandem::config {

TranslationRoom::TranslationRoom(const safety::ArmLimits& limits) {
  const int n = limits.jointCount() / 2;
  for (int i = 0; i < n; ++i) {
    room_.push_back({limits.joints[i].lower, limits.joints[i].upper});
    offset_.push_back({-safety::kUnlimited, safety::kUnlimited});
  }
  for (const safety::LinearRow& row : limits.rows) {
    Interval& step = offset_[row.outer_joint];
    if (row.kind == safety::RowKind::kCarriageSpacing)
      step.lower = std::max(step.lower, -row.b);
    if (row.kind == safety::RowKind::kMinimumExtension)
      step.upper = std::min(step.upper, row.b);
  }
  for (int i = n - 1; i > 0; --i) {
    room_[i - 1] = {std::max(room_[i - 1].lower, room_[i].lower - offset_[i].upper),
                    std::min(room_[i - 1].upper, room_[i].upper - offset_[i].lower)};
  }
}

TranslationRoom::Interval TranslationRoom::of(int tube, double before) const {
  if (tube == 0)
    return room_[0];
  return {std::max(room_[tube].lower, before + offset_[tube].lower),
          std::min(room_[tube].upper, before + offset_[tube].upper)};
}

}  // namespace tandem::config
