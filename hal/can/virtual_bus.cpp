// SPDX-License-Identifier: Apache-2.0
#include "hal/can/virtual_bus.h"

namespace tandem::hal::can {

VirtualBus::Port::Port(VirtualBus& wire, std::string name, const BusOptions& options, std::size_t capacity)
    : Bus(std::move(name), options), wire_(wire), ring_(capacity) {
  fd_frames_ = options.fd;
}

void VirtualBus::Port::put(const CanFrame& frame) noexcept {
  if (!accepts(frame))
    return;
  if (count_ == ring_.size()) {
    ++counters_.rx_overflow;
    return;
  }
  ring_[(first_ + count_++) % ring_.size()] = frame;
}

std::size_t VirtualBus::Port::send(std::span<const CanFrame> frames) noexcept {
  std::size_t taken = 0;
  while (taken < frames.size() && !wire_.blocked && state() < BusState::kOff && lengthIsValid(frames[taken]) &&
         (fd_frames_ || !frames[taken].fd)) {
    CanFrame frame = frames[taken++];
    frame.time = wire_.now;
    if (wire_.disturbance && !wire_.disturbance(frame))
      continue;
    if (wire_.tap)
      wire_.tap(frame);
    for (const auto& port : wire_.ports_) {
      if (port.get() != this)
        port->put(frame);
    }
  }
  const std::size_t left = frames.size() - taken;
  noteSend(frames.first(taken), wire_.blocked ? left : 0, wire_.blocked ? 0 : left);
  return taken;
}

std::size_t VirtualBus::Port::receive(std::span<CanFrame> frames) noexcept {
  std::size_t filled = 0;
  for (; filled < frames.size() && count_ > 0; ++filled, --count_) {
    frames[filled] = ring_[first_];
    first_ = (first_ + 1) % ring_.size();
    if (frames[filled].error)
      noteError(frames[filled]);
  }
  noteReceived(frames.first(filled));
  return filled;
}

VirtualBus::Port& VirtualBus::join(std::string name, const BusOptions& options) {
  ports_.push_back(std::unique_ptr<Port>(new Port(*this, std::move(name), options, capacity_)));
  return *ports_.back();
}

}  // namespace tandem::hal::can
