// SPDX-License-Identifier: Apache-2.0
#include "operation/tip_feedback.h"

#include <algorithm>

#include "operation/convert.h"
#include "safety/limits.h"

namespace tandem::operation {
namespace {

bool hasOrientation(const msg::TipPoses& message, int arm) noexcept {
  return planning::MeasuredTips::isOrientation(msg::tipOrientation(message, arm));
}

}  // namespace

void TipFeedback::take(const msg::TipPoses& message) noexcept {
  if (message.state_session != last_.state_session)
    forget();
  last_ = message;
  msg::takeTips(message, tips_);
}

void TipFeedback::forget() noexcept {
  tips_.forget();
  last_ = {};
}

msg::HoldReason TipFeedback::check(const planning::Reference& tasks,
                                   const msg::ActuationState& state,
                                   const safety::StateStamps& commands,
                                   std::int64_t now) noexcept {
  using msg::HoldReason;
  HoldReason reason = HoldReason::kNone;
  age_ = 0.0;
  planning::forEachArm(tasks, [&](int k, bool with_orientation) {
    if (k < 0 || k >= state.arm_count)
      return;  // the tracker refuses such a task
    const double age =
        planning::measuredAge(tips_, k, with_orientation, [&](const planning::MeasuredTips::Origin& origin) {
          return lock_step_ ? 1e-9 * static_cast<double>(state.stamp - origin.stamp)
                            : commands.age(origin.answers_command, now);
        });
    age_ = std::max(age_, age);
    if (age <= budget_)
      return;
    const auto i = static_cast<std::size_t>(k);
    const bool oriented = with_orientation && tips_.useOrientations();
    const bool invalid = last_.arm_count > k && (last_.valid[i] == 0 || (oriented && !hasOrientation(last_, k)));
    const bool known = tips_.knows(k, with_orientation);
    reason = invalid ? HoldReason::kInvalidTips : known ? HoldReason::kStaleTips : HoldReason::kNoTips;
  });
  return reason;
}

}  // namespace tandem::operation
