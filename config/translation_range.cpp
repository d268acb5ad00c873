// SPDX-License-Identifier: Apache-2.0
#include "config/translation_range.h"

#include <algorithm>

namespace tandem::config {

TranslationRange::TranslationRange(const safety::ArmLimits& limits) {
  const int n = limits.jointCount() / 2;
  for (int i = 0; i < n; ++i) {
    range_.push_back({limits.joints[i].lower, limits.joints[i].upper});
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
    range_[i - 1] = {std::max(range_[i - 1].lower, range_[i].lower - offset_[i].upper),
                     std::min(range_[i - 1].upper, range_[i].upper - offset_[i].lower)};
  }
}

TranslationRange::Interval TranslationRange::of(int tube, double before) const {
  if (tube == 0)
    return range_[0];
  return {std::max(range_[tube].lower, before + offset_[tube].lower),
          std::min(range_[tube].upper, before + offset_[tube].upper)};
}

}  // namespace tandem::config
