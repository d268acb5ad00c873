// SPDX-License-Identifier: Apache-2.0
/** @file Judges the stream of commands as a whole: whose it is, in which order, how old, for how many arms. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "safety/dimensions.h"
#include "safety/faults.h"

namespace tandem::safety {

/** What identifies one command of a stream. */
struct StreamHead {
  std::uint64_t session = 0;                             ///< of the commander; 0 is never accepted
  std::uint64_t sequence = 0;                            ///< counts up within the session; gaps are allowed
  double age = std::numeric_limits<double>::infinity();  ///< of the state that the command answers, s
  int arm_count = 0;
};

/** What the monitor thinks of one command. */
struct StreamVerdict {
  FaultMask faults = 0;      ///< kStaleCommand, kOutOfSequence, kUnknownArm; 0 = accepted
  double age_excess = 0.0;   ///< by how much the command is too old, s; 0 where the state is not known
  bool new_session = false;  ///< accepted, and from another session than the one before
};

/** One per robot, shared by its arms: a stream is good or bad for all of them.
 *
 * A session takes over from another one only while every arm stands; the caller has to disable the arms then, so that
 * the newcomer must enable them itself. */
class CommandMonitor {
 public:
  /// @param max_age budget of StreamHead::age, s; @param standing no arm moves.
  CommandMonitor(int arm_count, double max_age) : arm_count_(arm_count), max_age_(max_age) {}

  StreamVerdict check(const StreamHead& head, bool standing) noexcept;
  std::uint64_t session() const noexcept { return session_; }
  /// Sequence of the last command that was accepted, 0 before the first.
  std::uint64_t sequence() const noexcept { return accepted_; }

 private:
  int arm_count_;
  double max_age_;
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

/** Remembers which published state was the first to show an arm in FAULT. A `disable` clears what whoever sent it has
 * seen: one that was on its way when the fault came takes nothing away. */
class ShownFaults {
 public:
  /// Notes what the state with this sequence, which is being published, shows of an arm.
  void record(int arm, bool fault, std::uint64_t sequence) noexcept {
    std::uint64_t& first = first_[static_cast<std::size_t>(arm)];
    first = !fault ? 0 : first == 0 ? sequence : first;
  }
  /// Whether who answers that state knows of the fault that the arm is in.
  bool seen(int arm, std::uint64_t answers_state) const noexcept {
    const std::uint64_t first = first_[static_cast<std::size_t>(arm)];
    return first != 0 && answers_state >= first;
  }
  /// The fault is being cleared; the next one is another.
  void forget(int arm) noexcept { first_[static_cast<std::size_t>(arm)] = 0; }

 private:
  std::array<std::uint64_t, kMaxArms> first_{};  ///< 0: none is shown
};

}  // namespace tandem::safety
