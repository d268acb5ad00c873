// SPDX-License-Identifier: Apache-2.0
/** @file Feedback watch: arrival rate of an axis' TPDOs, and the following error of its joint. */
#pragma once

#include <array>
#include <cstdint>

#include "hal/canopen/network.h"
#include "hal/hardware.h"
#include "safety/budgets.h"
#include "safety/success_rate.h"

namespace tandem::hal {

/** What a node in operation may owe. */
struct FeedbackBudget {
  double silence = 0.0;  ///< how long it may say nothing, s
  double lost = 1.0;     ///< share of the last 100 TPDOs that may not have come; more than one such silence holds

  static FeedbackBudget of(const HardwareConfig& hardware, const safety::Budgets& budgets);
};

/** How often one TPDO came, against how often it should have. Times are ns. */
class FeedbackStream {
 public:
  /// The node was booted: the wait for the first TPDO begins with the next watch().
  void restart() noexcept { *this = {}; }
  /// Once per period, after Network::receive().
  void watch(const canopen::Tpdo& tpdo, const canopen::Network& network, std::int64_t now) noexcept;
  /// Came since the watch before.
  bool fresh() const noexcept { return fresh_; }
  /// @param budget for which a node in operation may owe its TPDO, s
  bool silent(const canopen::Network& network, double budget, std::int64_t now) const noexcept;
  /// Of the last 100 SYNCs: how many were answered.
  const safety::SuccessRate& success() const noexcept { return success_; }

 private:
  std::uint64_t count_ = 0;      ///< seen at the last watch
  std::uint64_t sync_mark_ = 0;  ///< SYNCs sent when it last came
  std::int64_t time_ = 0;        ///< when it last came
  bool fresh_ = false;
  bool begun_ = false;
  safety::SuccessRate success_;
};

/** Whether a joint is where it was commanded to be, and its drive takes notice of its commands. Times are ns. */
class FollowingWatch {
 public:
  /// The joint begins to be moved or held, at `target`.
  void restart(double target) noexcept;
  /// Every period: what is sent now. A command acts two periods later.
  void reported(double target) noexcept { recent_[next_++ % recent_.size()] = target; }
  void forget(double target) noexcept { recent_.fill(target); }
  /// A new measurement. @param window that the error may fill
  void measured(double position, double window, std::int64_t now) noexcept;
  /// @param follows the drive says so, or cannot say
  void follows(bool follows, std::int64_t now) noexcept;

  /// Distance from where the joint may be between the last targets, m or rad.
  double error() const noexcept { return error_; }
  void clearError() noexcept { error_ = 0.0; }
  /// Outside the window for so many s.
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
