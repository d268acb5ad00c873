// SPDX-License-Identifier: Apache-2.0
/** @file Automatic power-off of arms that have power while no client commands them. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "safety/dimensions.h"

namespace tandem::safety {

/** Idle time of each arm: how long it has had power without a command. Call step() once per cycle. Nothing allocates,
 * locks or throws; times are ns on the caller's clock. */
class IdlePower {
 public:
  /// Decision for an idle arm.
  enum class Decision : std::uint8_t {
    kNothing = 0,
    kPowerOff,  ///< idle for the time-out, and the arm keeps its position without power
    kWarn,  ///< idle for the time-out, but the arm would not keep its position; repeated after each further time-out
  };

  /// @param timeout s; infinite: no power-off.
  explicit IdlePower(double timeout) : timeout_(timeout) {}

  /** Call once per cycle and arm.
   * @param powered the arm has power, or is about to get it
   * @param commanded a client commands the robot, or it moves
   * @param holds the arm keeps its position without power */
  Decision step(int arm, bool powered, bool commanded, bool holds, std::int64_t now) noexcept {
    Arm& a = arms_[static_cast<std::size_t>(arm)];
    if (!powered || commanded || !a.idle) {
      a = {powered && !commanded, holds, 1.0, now, now};
      return Decision::kNothing;
    }
    a.holds = holds;
    a.now = now;
    if (idle(arm) < a.due * timeout_)
      return Decision::kNothing;
    a.due = std::floor(idle(arm) / timeout_) + 1.0;
    return holds ? Decision::kPowerOff : Decision::kWarn;
  }

  /// Idle time of an arm, s; 0: not idle.
  double idle(int arm) const noexcept {
    const Arm& a = arms_[static_cast<std::size_t>(arm)];
    return a.idle ? 1e-9 * static_cast<double>(a.now - a.since) : 0.0;
  }
  /// Time until an idle arm loses power, s; -1: it keeps power, or is not idle.
  double left(int arm) const noexcept {
    const Arm& a = arms_[static_cast<std::size_t>(arm)];
    return a.idle && a.holds && std::isfinite(timeout_) ? std::max(0.0, timeout_ - idle(arm)) : -1.0;
  }
  double timeout() const noexcept { return timeout_; }

 private:
  struct Arm {
    bool idle = false;
    bool holds = false;
    double due = 1.0;  ///< the next decision, in multiples of the time-out
    std::int64_t since = 0;
    std::int64_t now = 0;
  };
  double timeout_;
  std::array<Arm, kMaxArms> arms_{};
};

}  // namespace tandem::safety
