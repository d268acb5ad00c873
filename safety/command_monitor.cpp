// SPDX-License-Identifier: Apache-2.0
#include "safety/command_monitor.h"

#include <cmath>

namespace tandem::safety {

StreamCheck CommandMonitor::check(const StreamHeader& header, bool standing) noexcept {
  StreamCheck checked;
  if (header.arrivals > 0) {
    success_.note(header.session, header.sequence, header.stamp, header.arrivals);
    checked.lost = success_.judge(Fault::kCommandTimeout, lost_samples_, max_age_);
  }
  // Written so that an age that is NaN counts as too old.
  if (!(header.age <= max_age_)) {
    checked.faults |= bit(Fault::kStaleCommand);
    checked.age_excess = std::isfinite(header.age) ? header.age - max_age_ : 0.0;
  }
  if (header.arm_count != arm_count_)
    checked.faults |= bit(Fault::kUnknownArm);
  const bool same = header.session == session_;
  const bool in_order = same ? header.sequence > last_ : standing;
  if (header.session == 0 || !in_order)
    checked.faults |= bit(Fault::kOutOfSequence);
  // A command refused for its age still uses up its number: a copy of it must not be accepted.
  if (same && in_order)
    last_ = header.sequence;
  if (checked.faults != 0)
    return checked;
  checked.new_session = !same;
  session_ = header.session;
  last_ = header.sequence;
  accepted_ = header.sequence;
  return checked;
}

double StateStamps::age(std::uint64_t sequence, std::int64_t now) const noexcept {
  const Slot& slot = slots_[sequence % kSlots];
  if (sequence == 0 || slot.sequence != sequence)
    return std::numeric_limits<double>::infinity();
  return 1e-9 * static_cast<double>(now - slot.stamp);
}

}  // namespace tandem::safety
