// SPDX-License-Identifier: Apache-2.0
#include "operation/tip_feedback.h"

#include <algorithm>

#include "operation/convert.h"
#include "safety/limits.h"

namespace tandem::operation {

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
  planning::forEachArm(tasks, [&](int k) {
    if (k < 0 || k >= state.arm_count)
      return;  // the tracker refuses such a task
    const auto i = static_cast<std::size_t>(k);
    const planning::MeasuredTips::Entry& tip = tips_.arm[i];
    double age = safety::kUnlimited;
    if (tip.known)
      age = lock_step_ ? 1e-9 * static_cast<double>(state.stamp - tip.stamp) : commands.age(tip.answers_command, now);
    age_ = std::max(age_, age);
    if (age <= budget_)
      return;
    const bool invalid = last_.arm_count > k && last_.valid[i] == 0;
    reason = invalid ? HoldReason::kInvalidTips : tip.known ? HoldReason::kStaleTips : HoldReason::kNoTips;
  });
  return reason;
}

}  // namespace tandem::operation
