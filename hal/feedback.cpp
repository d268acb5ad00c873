// SPDX-License-Identifier: Apache-2.0
#include "hal/feedback.h"

#include <algorithm>
#include <cmath>

#include "hal/nanoseconds.h"

namespace tandem::hal {

FeedbackBudget FeedbackBudget::of(const HardwareConfig& hardware, const safety::Budgets& budgets) {
  const double silence = std::max(hardware.feedback_budget, 3.0 * hardware.period);
  return {silence, safety::SuccessRate::allowed(budgets.lost_samples, silence, hardware.period)};
}

void FeedbackStream::watch(const Arrivals& arrivals, std::int64_t now) noexcept {
  fresh_ = begun_ && arrivals.received != count_;
  success_.note(arrivals.expected, arrivals.received);
  expected_ = arrivals.expected;
  if (begun_ && !fresh_)
    return;
  begun_ = true;
  count_ = arrivals.received;
  time_ = now;
  mark_ = arrivals.expected;
}

bool FeedbackStream::silent(double budget, std::int64_t now) const noexcept {
  // If this process itself was delayed, missing samples are no evidence: their number counts, too.
  return expected_ - mark_ >= kMissed && now - time_ > nanoseconds(budget);
}

void FollowingWatch::restart(double target) noexcept {
  forget(target);
  outside_since_ = ignored_since_ = 0;
}

void FollowingWatch::measured(double position, double window, std::int64_t now) noexcept {
  const auto [least, most] = std::minmax_element(recent_.begin(), recent_.end());
  error_ = position > *most ? position - *most : position < *least ? position - *least : 0.0;
  if (std::abs(error_) <= window) {
    outside_since_ = 0;
  } else if (outside_since_ == 0) {
    outside_since_ = now;
  }
}

void FollowingWatch::follows(bool follows, std::int64_t now) noexcept {
  if (follows) {
    ignored_since_ = 0;
  } else if (ignored_since_ == 0) {
    ignored_since_ = now;
  }
}

bool FollowingWatch::longer(std::int64_t since, double time, std::int64_t now) noexcept {
  return since != 0 && now - since >= nanoseconds(time);
}

}  // namespace tandem::hal
