// SPDX-License-Identifier: Apache-2.0
/** @file In-process bus for tests in simulated time. */
#pragma once

#include <functional>
#include <vector>

#include "hal/can/bus.h"

namespace tandem::hal::can {

/** The bus: all other ports receive the frames of one port at once, stamped with `now`. */
class VirtualBus {
 public:
  /** Endpoint of one participant. */
  class Port final : public Bus {
   public:
    std::size_t send(std::span<const CanFrame> frames) noexcept override;
    std::size_t receive(std::span<CanFrame> frames) noexcept override;
    int fd() const noexcept override { return -1; }

   private:
    friend class VirtualBus;
    Port(VirtualBus& wire, std::string name, const BusOptions& options, std::size_t capacity);
    void put(const CanFrame& frame) noexcept;

    VirtualBus& wire_;
    std::vector<CanFrame> ring_;
    std::size_t first_ = 0;
    std::size_t count_ = 0;
  };

  explicit VirtualBus(std::size_t capacity = 1024) : capacity_(capacity) {}
  VirtualBus(const VirtualBus&) = delete;
  VirtualBus& operator=(const VirtualBus&) = delete;

  /// Adds a participant, which lives as long as the bus.
  Port& join(std::string name, const BusOptions& options = {});

  std::int64_t now = 0;                        ///< time stamp of sent frames, ns
  std::function<bool(CanFrame&)> disturbance;  ///< called once per frame, may change it; false: the frame is lost
  std::function<void(const CanFrame&)> tap;    ///< called for each frame that reached the bus
  /// The transmit queues of all participants are full: send() drops.
  bool blocked = false;

 private:
  std::size_t capacity_;
  std::vector<std::unique_ptr<Port>> ports_;
};

}  // namespace tandem::hal::can
