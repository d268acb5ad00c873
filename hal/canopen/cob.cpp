// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/cob.h"

namespace tandem::hal::canopen {

std::string_view name(NmtState state) {
  switch (state) {
    case NmtState::kBootUp:
      return "boot-up";
    case NmtState::kStopped:
      return "stopped";
    case NmtState::kOperational:
      return "operational";
    case NmtState::kPreOperational:
      return "pre-operational";
    case NmtState::kUnknown:
      break;
  }
  return "unknown";
}

CanFrame nmtFrame(NmtCommand command, int node) noexcept {
  const std::uint8_t bytes[] = {static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(node)};
  return can::makeFrame(cob::kNmt, bytes);
}

CanFrame heartbeatFrame(int node, NmtState state) noexcept {
  const std::uint8_t bytes[] = {static_cast<std::uint8_t>(state)};
  return can::makeFrame(cob::kHeartbeat + static_cast<std::uint32_t>(node), bytes);
}

CanFrame syncFrame(std::uint8_t counter, std::uint32_t id) noexcept {
  return can::makeFrame(id, {&counter, counter == 0 ? 0u : 1u});
}

}  // namespace tandem::hal::canopen
