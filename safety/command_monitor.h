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

/** Identification of one command of a stream. */
struct StreamHeader {
  std::uint64_t session = 0;                             ///< session of the sender; 0 is never accepted
  std::uint64_t sequence = 0;                            ///< counts up within the session; gaps are allowed
  double age = std::numeric_limits<double>::infinity();  ///< of the state that the command answers, s
  int arm_count = 0;
  std::int64_t stamp = 0;      ///< of the sender, ns
  std::uint64_t arrivals = 0;  ///< commands received so far, this one included; 0: not counted
};

/** Result of the validation of one command. */
struct StreamCheck {
  FaultMask faults = 0;      ///< kStaleCommand, kOutOfSequence, kUnknownArm; 0 = accepted
  double age_excess = 0.0;   ///< time by which the command exceeds the age budget, s; 0 if the state is unknown
  bool new_session = false;  ///< accepted, from another session than the previous command
  FaultRecord lost;          ///< too many previous commands are lost: a reason to stop, not to refuse this command
};

/** Validator of the command stream of one robot; the result applies to all its arms.
 *
 * A new session is accepted only while all arms are at standstill. The caller must disable the arms then, so that the
 * new sender has to enable them itself. */
class CommandMonitor {
 public:
  /// @param max_age budget of StreamHeader::age, s; @param lost_samples as in Budgets
  CommandMonitor(int arm_count, double max_age, double lost_samples)
      : arm_count_(arm_count), max_age_(max_age), lost_samples_(lost_samples) {}

  /// @param standing no arm moves.
  StreamCheck check(const StreamHeader& header, bool standing) noexcept;
  std::uint64_t session() const noexcept { return session_; }
  /// Sequence of the last command that was accepted, 0 before the first.
  std::uint64_t sequence() const noexcept { return accepted_; }
  /// Share of the last 100 commands that have arrived.
  double success() const noexcept { return success_.value(); }
  /// Excludes the losses so far from stop decisions: no arm has power.
  void resetLosses() noexcept { success_.resetLosses(); }

 private:
  int arm_count_;
  double max_age_, lost_samples_;
  StreamSuccess success_;
  std::uint64_t session_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t accepted_ = 0;
};

/** Publication times of states: the age of an answer is measured on the publisher's own clock. */
class StateStamps {
 public:
  /// Records that the state with this sequence is published at `now`, ns.
  void record(std::uint64_t sequence, std::int64_t now) noexcept { slots_[sequence % kSlots] = {sequence, now}; }
  /// Age of that state, s; infinite if it is unknown or no longer stored.
  double age(std::uint64_t sequence, std::int64_t now) const noexcept;

 private:
  static constexpr std::size_t kSlots = 4096;
  struct Slot {
    std::uint64_t sequence = 0;
    std::int64_t stamp = 0;
  };
  std::array<Slot, kSlots> slots_{};
};

/** First published state that contains the present faults of an arm. A `disable` clears only faults that its sender has
 * received: a `disable` sent before a fault was published does not clear it. */
class ReportedFaults {
 public:
  /// Records the faults of an arm in the state with this sequence.
  void record(int arm, FaultMask faults, std::uint64_t sequence) noexcept {
    Reported& reported = reported_[static_cast<std::size_t>(arm)];
    if ((faults & ~reported.faults) != 0)
      reported.since = sequence;
    reported.faults = faults;
  }
  /// Whether the sender that answers the state with this sequence has received all present faults of the arm.
  bool seen(int arm, FaultMask faults, std::uint64_t answers) const noexcept {
    const Reported& reported = reported_[static_cast<std::size_t>(arm)];
    return faults == 0 || ((faults & ~reported.faults) == 0 && answers >= reported.since);
  }
  /// Removes the record: the faults are cleared or raised anew, and later ones count as different faults.
  void forget(int arm) noexcept { reported_[static_cast<std::size_t>(arm)] = {}; }

 private:
  struct Reported {
    FaultMask faults = 0;
    std::uint64_t since = 0;  ///< sequence of the state that added the last of them
  };
  std::array<Reported, kMaxArms> reported_{};
};

}  // namespace tandem::safety
