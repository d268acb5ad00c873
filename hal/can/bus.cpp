// SPDX-License-Identifier: Apache-2.0
#include "hal/can/bus.h"

#include <linux/can/error.h>

#include <algorithm>
#include <stdexcept>

#include "hal/can/detail/seqpacket.h"
#include "hal/can/detail/socketcan.h"

namespace tandem::hal::can {
namespace {

/// State in the controller's detail byte; false if the byte reports overflows only.
bool stateOfDetail(std::uint8_t detail, BusState& state) noexcept {
  if (detail & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) {
    state = BusState::kPassive;
  } else if (detail & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) {
    state = BusState::kWarning;
  } else if (detail & CAN_ERR_CRTL_ACTIVE) {
    state = BusState::kActive;
  } else {
    return false;
  }
  return true;
}

}  // namespace

Bus::Bus(std::string name, const BusOptions& options)
    : name_(std::move(name)), filters_(options.filters), max_consecutive_drops_(options.max_consecutive_drops) {}

bool Bus::faulty() const noexcept {
  return state_ == BusState::kOff || state_ == BusState::kDown || consecutive_drops_ >= max_consecutive_drops_;
}

void Bus::noteState(BusState state) noexcept {
  if (state == state_)
    return;
  counters_.bus_off += state == BusState::kOff;
  counters_.restarts += state_ == BusState::kOff && state != BusState::kDown;
  counters_.link_losses += state == BusState::kDown;
  state_ = state;
  consecutive_drops_ = 0;
}

void Bus::noteError(const CanFrame& frame) noexcept {
  ++counters_.error_frames;
  if (frame.id & CAN_ERR_CNT) {
    counters_.tx_errors = frame.data[6];
    counters_.rx_errors = frame.data[7];
  }
  if (frame.id & CAN_ERR_BUSOFF) {
    noteState(BusState::kOff);
    return;
  }
  if (frame.id & CAN_ERR_RESTARTED)
    noteState(BusState::kActive);
  BusState state = state_;
  // A controller in bus-off stays there until it is restarted, whatever else it reports.
  if ((frame.id & CAN_ERR_CRTL) && state_ != BusState::kOff && stateOfDetail(frame.data[1], state))
    noteState(state);
}

void Bus::noteReceived(std::span<const CanFrame> frames) noexcept {
  counters_.received += frames.size();
  for (const CanFrame& frame : frames)
    counters_.data_bytes += frame.error ? 0 : frame.payload().size();
}

void Bus::noteSend(std::span<const CanFrame> taken, std::size_t dropped, std::size_t failed) noexcept {
  counters_.sent += taken.size();
  for (const CanFrame& frame : taken)
    counters_.data_bytes += frame.payload().size();
  counters_.tx_dropped += dropped;
  counters_.tx_failed += failed;
  if (dropped > 0) {
    consecutive_drops_ = std::min(consecutive_drops_ + 1, max_consecutive_drops_);
  } else if (!taken.empty()) {
    consecutive_drops_ = 0;
  }
}

bool Bus::accepts(const CanFrame& frame) const noexcept {
  if (filters_.empty() || frame.error)
    return true;
  return std::ranges::any_of(filters_, [&](const Filter& filter) {
    return filter.extended == frame.extended && !frame.remote && (frame.id & filter.mask) == (filter.id & filter.mask);
  });
}

std::unique_ptr<Bus> openBus(const std::string& address, const BusOptions& options) {
  const std::size_t colon = address.find(':');
  const std::string kind = address.substr(0, colon);
  const std::string rest = colon == std::string::npos ? "" : address.substr(colon + 1);
  if (!rest.empty()) {
    if (kind == "can")
      return std::make_unique<SocketCanBus>(rest, options);
    if (kind == "unix")
      return std::make_unique<SeqpacketBus>(rest, options);
    if (kind == "unix-hub")
      return std::make_unique<SeqpacketHub>(rest, options);
  }
  throw std::invalid_argument("bus address '" + address + "': expected can:INTERFACE, unix:PATH or unix-hub:PATH");
}

}  // namespace tandem::hal::can
