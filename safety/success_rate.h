// SPDX-License-Identifier: Apache-2.0
/** @file Success rate of a stream: share of its last 100 samples that have arrived (libfranka:
 * control_command_success_rate). */
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "safety/faults.h"

namespace tandem::safety {

/** Share of the last 100 due samples that have arrived: `control_command_success_rate` of libfranka. Compares two
 * totals, so a late sample that arrives is not lost. Nothing allocates, locks or throws. */
class SuccessRate {
 public:
  static constexpr std::uint64_t kWindow = 100;  ///< samples

  /// Totals so far: of samples that were due, and of those that have arrived. Counting starts with the first call.
  void note(std::uint64_t due, std::uint64_t came) noexcept {
    if (!begun_ || due < due_ || due - due_ > kJump) {
      begin(due, came);
      return;
    }
    // Only a later sample that arrives proves a loss.
    const auto lost = static_cast<std::int64_t>(due - first_due_) - static_cast<std::int64_t>(came - first_came_);
    const std::uint64_t news = due - due_;
    for (std::uint64_t i = news > kWindow ? news - kWindow : 0; i < news; ++i)
      before_[(due_ + 1 + i) % kWindow] = std::min(lost_ + static_cast<std::int64_t>(i), std::max(lost_, lost));
    due_ = due;
    lost_ = lost;
  }
  /// Samples of the window that have not arrived.
  std::uint64_t lost() const noexcept {
    const std::int64_t lost = lost_ - before_[(due_ + 1) % kWindow];
    return static_cast<std::uint64_t>(std::clamp<std::int64_t>(lost, 0, kWindow));
  }
  /// The same, without those that were lost before the last resetLosses().
  std::uint64_t held() const noexcept {
    const std::int64_t held = lost_ - std::max(before_[(due_ + 1) % kWindow], lost_at_reset_);
    return static_cast<std::uint64_t>(std::clamp<std::int64_t>(held, 0, kWindow));
  }
  void resetLosses() noexcept { lost_at_reset_ = lost_; }
  /// 0 to 1; 1 before the first sample.
  double value() const noexcept { return 1.0 - share(lost()); }
  static constexpr double share(std::uint64_t lost) noexcept {
    return static_cast<double>(lost) / static_cast<double>(kWindow);
  }
  /** Share that may be lost: `lost_samples` of Budgets, or one outage as long as the age budget of a sample: longer
   * outages are detected by age.
   * @param outage  s  @param period  of the samples, s; 0: unknown */
  static double allowed(double lost_samples, double outage, double period) noexcept {
    const double of_outage = period > 0.0 ? outage / (period * static_cast<double>(kWindow)) : 1.0;
    return std::max(lost_samples, std::min(1.0, of_outage));
  }

 private:
  static constexpr std::uint64_t kJump = 1u << 31;  ///< a larger step of the total means another stream

  void begin(std::uint64_t due, std::uint64_t came) noexcept {
    begun_ = true;
    first_due_ = due_ = due;
    first_came_ = came;
    lost_ = lost_at_reset_ = 0;
    before_.fill(0);
  }

  bool begun_ = false;
  std::uint64_t first_due_ = 0, first_came_ = 0, due_ = 0;
  std::int64_t lost_ = 0;                       ///< since the start; negative while a sample is counted early
  std::int64_t lost_at_reset_ = 0;              ///< value of lost_ at the last resetLosses()
  std::array<std::int64_t, kWindow> before_{};  ///< value of lost_ before each sample of the window
};

/** Success rate of a stream whose samples carry the sender's session, a sequence and a stamp. */
class StreamSuccess {
 public:
  /// @param stamp  of the sender, ns  @param arrivals  samples of all sessions received so far, this one included
  void note(std::uint64_t session, std::uint64_t sequence, std::int64_t stamp, std::uint64_t arrivals) noexcept {
    if (session != session_ || sequence < first_sequence_) {
      *this = {};
      session_ = session;
      first_sequence_ = sequence;
      first_stamp_ = stamp;
    }
    rate_.note(sequence, arrivals);
    if (sequence > first_sequence_)
      period_ = 1e-9 * (static_cast<double>(stamp) - static_cast<double>(first_stamp_)) /
                static_cast<double>(sequence - first_sequence_);
  }
  double value() const noexcept { return rate_.value(); }
  /// Excludes the losses so far from judge(): nothing has power. value() still includes them.
  void resetLosses() noexcept { rate_.resetLosses(); }
  /// Fault if more of the last 100 samples than allowed() were lost since the last resetLosses(), else empty.
  /// @param fault  to report  @param lost_samples  of Budgets  @param outage  age budget of a sample, s
  FaultRecord judge(Fault fault, double lost_samples, double outage) const noexcept {
    const double lost = SuccessRate::share(rate_.held());
    const double allowed = SuccessRate::allowed(lost_samples, outage, period_);
    return lost > allowed ? FaultRecord{bit(fault), FaultCause::kLost, idl::kNoJoint, lost, allowed} : FaultRecord{};
  }

 private:
  SuccessRate rate_;
  std::uint64_t session_ = 0, first_sequence_ = 0;
  std::int64_t first_stamp_ = 0;
  double period_ = 0.0;  ///< of the sender, s; 0: unknown
};

}  // namespace tandem::safety
