// SPDX-License-Identifier: Apache-2.0
/** @file Feedback watch: arrival rate of an axis' samples, and the following error of its joint. */
#pragma once

#include <array>
#include <cstdint>

#include "hal/axis_driver.h"
#include "hal/hardware.h"
#include "safety/budgets.h"
#include "safety/success_rate.h"

namespace tandem::hal {

/** Budgets for missing feedback of a device in operation. */
struct FeedbackBudget {
  double silence = 0.0;  ///< longest time without feedback, s
  double lost = 1.0;     ///< largest share of missing samples among the last 100; more than one such silence contains

  static FeedbackBudget of(const HardwareConfig& hardware, const safety::Budgets& budgets);
};

/** Reception statistics of the samples of one device. Times are ns. */
class FeedbackStream {
 public:
  /// The device was booted: the time-out for the first sample starts with the next watch().
  void restart() noexcept { *this = {}; }
  /// Once per period.
  void watch(const Arrivals& arrivals, std::int64_t now) noexcept;
  /// Received since the last watch().
  bool fresh() const noexcept { return fresh_; }
  /// @param budget longest time without a sample of a device in operation, s
  bool silent(double budget, std::int64_t now) const noexcept;
  /// Share of received samples among the last 100 expected ones.
  const safety::SuccessRate& success() const noexcept { return success_; }

 private:
  /// A sample counts as missing after so many expected ones, and not before the time budget.
  static constexpr std::uint64_t kMissed = 3;
  std::uint64_t count_ = 0;     ///< received at the last watch
  std::uint64_t expected_ = 0;  ///< at the last watch
  std::uint64_t mark_ = 0;      ///< expected at the last reception
  std::int64_t time_ = 0;       ///< of the last reception
  bool fresh_ = false;
  bool begun_ = false;
  safety::SuccessRate success_;
};

/** Detects following errors of a joint, and a drive that ignores its commands. Times are ns. */
class FollowingWatch {
 public:
  /// Starts to watch a joint that is moved or held at `target`.
  void restart(double target) noexcept;
  /// Every period: the target sent now. A command acts two periods later.
  void reported(double target) noexcept { recent_[next_++ % recent_.size()] = target; }
  void forget(double target) noexcept { recent_.fill(target); }
  /// A new measurement. @param window largest permitted error
  void measured(double position, double window, std::int64_t now) noexcept;
  /// @param follows the drive reports that it follows, or cannot report it
  void follows(bool follows, std::int64_t now) noexcept;

  /// Distance to the interval of the last targets, m or rad.
  double error() const noexcept { return error_; }
  void clearError() noexcept { error_ = 0.0; }
  /// Outside the window for `time`, s.
  bool outside(double time, std::int64_t now) const noexcept { return longer(outside_since_, time, now); }
  bool ignored(double time, std::int64_t now) const noexcept { return longer(ignored_since_, time, now); }

 private:
  static bool longer(std::int64_t since, double time, std::int64_t now) noexcept;

  std::array<double, 4> recent_{};
  std::size_t next_ = 0;
  double error_ = 0.0;
  std::int64_t outside_since_ = 0;  ///< 0: inside
  std::int64_t ignored_since_ = 0;  ///< 0: follows
};

}  // namespace tandem::hal
