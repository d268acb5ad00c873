// SPDX-License-Identifier: Apache-2.0
/** @file Background thread for the equilibria of catheters: solving takes long and allocates. */
#pragma once

#include <optional>
#include <string>

#include "robots/mechanisms.h"
#include "services/runtime/latest_value.h"
#include "services/runtime/outbox.h"
#include "services/runtime/process.h"

namespace tandem::service {

/** Settles where it is asked to, the newest wish first; wishes in between are left out. */
class Settler {
 public:
  /** Where, and when that was asked. A plain struct. */
  struct Wish {
    std::int64_t stamp = 0;       ///< ns
    std::uint32_t placement = 0;  ///< counts how often the joints were put elsewhere without a path
    int joint_count = 0;
    std::array<double, safety::kMaxJoints> joints{};  ///< m, rad
  };
  struct Answer {
    std::int64_t stamp = 0;  ///< of the wish
    std::uint32_t placement = 0;
    planning::Rest rest;
  };

  /// @throw std::invalid_argument as robots::makeRestFollower() does.
  explicit Settler(const Setup& setup);

  /// Before enterRealtime(): the thread inherits the scheduling of the caller. Without a thread ask() itself settles,
  /// and allocates.
  void start();
  void stop() { outbox_.stop(); }

  /// Wait-free; from one thread.
  void ask(const Wish& wish) noexcept;
  /// Wait-free; from one thread. @return whether there is a rest that was not taken before.
  bool take(Answer& answer) noexcept { return answers_.take(answer); }

 private:
  void settle(const Wish& wish);

  const Setup& setup_;
  std::optional<robots::RestFollower> follower_;
  std::uint32_t placement_ = 0;
  std::string told_;  ///< why there was no rest, the last time
  Answer answer_;
  LatestValue<Answer> answers_;
  bool started_ = false;
  Outbox outbox_;
  Outbox::Latest<Wish>& wishes_;
};

}  // namespace tandem::service
