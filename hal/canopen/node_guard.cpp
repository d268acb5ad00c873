// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/node_guard.h"

namespace tandem::hal::canopen {
namespace {

constexpr std::uint8_t kToggle = 0x80;

bool isState(std::uint8_t state) noexcept { return state == 0 || state == 4 || state == 5 || state == 127; }

}  // namespace

CanFrame guardFrame(int node) noexcept {
  CanFrame frame;
  frame.id = cob::kHeartbeat + static_cast<std::uint32_t>(node);
  frame.remote = true;
  frame.length = 1;
  return frame;
}

void NodeGuard::restart() noexcept {
  next_ = 0;
  toggle_ = 0;
}

void NodeGuard::sent(std::int64_t now) noexcept {
  // On its time grid, but without a burst after a pause.
  next_ += period_;
  if (next_ <= now)
    next_ = now + period_;
}

bool NodeGuard::take(std::uint8_t byte, NmtState& state) noexcept {
  const std::uint8_t toggle = byte & kToggle;
  const auto number = static_cast<std::uint8_t>(byte & ~kToggle);
  state = static_cast<NmtState>(number);
  if (!isState(number) || (toggle != 0 && !used()))
    return false;
  if (!used() || state == NmtState::kBootUp)
    return true;
  const bool expected = toggle == toggle_;
  toggle_ = expected ? toggle ^ kToggle : toggle_;
  return expected;
}

}  // namespace tandem::hal::canopen
