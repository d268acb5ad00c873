// SPDX-License-Identifier: Apache-2.0
/** @file Command stream validation: source, sequence, age, number of arms. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "safety/dimensions.h"
#include "safety/faults.h"
#include "safety/success_rate.h"

namespace tandem::safety {

/** What identifies one command of a stream. */
struct StreamHeader {
  std::uint64_t session = 0;                             ///< of the commander; 0 is never accepted
  std::uint64_t sequence = 0;                            ///< counts up within the session; gaps are allowed
  double age = std::numeric_limits<double>::infinity();  ///< of the state that the command answers, s
  int arm_count = 0;
  std::int64_t stamp = 0;      ///< of the commander, ns
  std::uint64_t arrivals = 0;  ///< commands that have come so far, with this one; 0: nobody counts
};

/** What the monitor thinks of one command. */
struct StreamCheck {
  FaultMask faults = 0;      ///< kStaleCommand, kOutOfSequence, kUnknownArm; 0 = accepted
  double age_excess = 0.0;   ///< by how much the command is too old, s; 0 where the state is not known
  bool new_session = false;  ///< accepted, and from another session than the one before
  FaultRecord lost;          ///< too many commands before it did not come: no reason to refuse this one, but to stop
};

/** One per robot, shared by its arms: a stream is good or bad for all of them.
 *
 * A session takes over from another one only while every arm stands; the caller has to disable the arms then, so that
 * the newcomer must enable them itself. */
class CommandMonitor {
 public:
  /// @param max_age budget of StreamHeader::age, s; @param lost_samples as in Budgets; @param standing no arm moves.
  CommandMonitor(int arm_count, double max_age, double lost_samples)
      : arm_count_(arm_count), max_age_(max_age), lost_samples_(lost_samples) {}

  StreamCheck check(const StreamHeader& header, bool standing) noexcept;
  std::uint64_t session() const noexcept { return session_; }
  /// Sequence of the last command that was accepted, 0 before the first.
  std::uint64_t sequence() const noexcept { return accepted_; }
  /// Share of the last 100 commands that came.
  double success() const noexcept { return success_.value(); }
  /// What was lost until now shall stop nobody: no arm has power.
  void resetLosses() noexcept { success_.resetLosses(); }

 private:
  int arm_count_;
  double max_age_, lost_samples_;
  StreamSuccess success_;
  std::uint64_t session_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t accepted_ = 0;
};

/** Remembers when states were published, so that the age of an answer is measured on the publisher's own clock. */
class StateStamps {
 public:
  /// Notes that the state with this sequence is being published at `now`, ns.
  void record(std::uint64_t sequence, std::int64_t now) noexcept { slots_[sequence % kSlots] = {sequence, now}; }
  /// Age of that state in s; infinite where it is unknown or longer gone than this memory.
  double age(std::uint64_t sequence, std::int64_t now) const noexcept;

 private:
  static constexpr std::size_t kSlots = 4096;
  struct Slot {
    std::uint64_t sequence = 0;
    std::int64_t stamp = 0;
  };
  std::array<Slot, kSlots> slots_{};
};

/** Remembers which published state was the first to show the faults of an arm. A `disable` clears what whoever sent it
 * has seen: one that was on its way when a fault came takes nothing away. */
class ReportedFaults {
 public:
  /// Notes what the state with this sequence, which is being published, shows of an arm.
  void record(int arm, FaultMask faults, std::uint64_t sequence) noexcept {
    Reported& reported = reported_[static_cast<std::size_t>(arm)];
    if ((faults & ~reported.faults) != 0)
      reported.since = sequence;
    reported.faults = faults;
  }
  /// Whether who answers the state with this sequence knows of all faults that the arm has now.
  bool seen(int arm, FaultMask faults, std::uint64_t answers) const noexcept {
    const Reported& reported = reported_[static_cast<std::size_t>(arm)];
    return faults == 0 || ((faults & ~reported.faults) == 0 && answers >= reported.since);
  }
  /// They are being cleared, or come anew: the next ones are others.
  void forget(int arm) noexcept { reported_[static_cast<std::size_t>(arm)] = {}; }

 private:
  struct Reported {
    FaultMask faults = 0;
    std::uint64_t since = 0;  ///< the sequence that showed the last of them
  };
  std::array<Reported, kMaxArms> reported_{};
};

}  // namespace tandem::safety
