// SPDX-License-Identifier: Apache-2.0
#include "safety/command_monitor.h"

#include <cmath>

namespace tandem::safety {

StreamVerdict CommandMonitor::check(const StreamHead& head, bool standing) noexcept {
  StreamVerdict verdict;
  if (head.arrivals > 0) {
    success_.note(head.session, head.sequence, head.stamp, head.arrivals);
    verdict.lost = success_.judge(Fault::kCommandTimeout, lost_samples_, max_age_);
  }
  // Written so that an age that is NaN counts as too old.
  if (!(head.age <= max_age_)) {
    verdict.faults |= bit(Fault::kStaleCommand);
    verdict.age_excess = std::isfinite(head.age) ? head.age - max_age_ : 0.0;
  }
  if (head.arm_count != arm_count_)
    verdict.faults |= bit(Fault::kUnknownArm);
  const bool same = head.session == session_;
  const bool in_order = same ? head.sequence > last_ : standing;
  if (head.session == 0 || !in_order)
    verdict.faults |= bit(Fault::kOutOfSequence);
  // A command that is refused for its age still uses up its number: it must not come a second time.
  if (same && in_order)
    last_ = head.sequence;
  if (verdict.faults != 0)
    return verdict;
  verdict.new_session = !same;
  session_ = head.session;
  last_ = head.sequence;
  accepted_ = head.sequence;
  return verdict;
}

double StateStamps::age(std::uint64_t sequence, std::int64_t now) const noexcept {
  const Slot& slot = slots_[sequence % kSlots];
  if (sequence == 0 || slot.sequence != sequence)
    return std::numeric_limits<double>::infinity();
  return 1e-9 * static_cast<double>(now - slot.stamp);
}

}  // namespace tandem::safety
