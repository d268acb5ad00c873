// SPDX-License-Identifier: Apache-2.0
/** @file In-process bus for tests in simulated time. */
#pragma once

#include <functional>
#include <vector>

#include "hal/can/bus.h"

namespace tandem::hal::can {

/** The wire: what one of its ports sends, all others receive at once, stamped with `now`. */
class VirtualBus {
 public:
  /** One party. */
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

  /// A new party, alive as long as the wire.
  Port& join(std::string name, const BusOptions& options = {});

  std::int64_t now = 0;                        ///< stamp of the frames that are sent, ns
  std::function<bool(CanFrame&)> disturbance;  ///< sees, and may change, each frame; false: lost. Called once per frame
  std::function<void(const CanFrame&)> tap;    ///< sees each frame that reached the wire
  /// The transmit queue of all parties is full: send() drops.
  bool blocked = false;

 private:
  std::size_t capacity_;
  std::vector<std::unique_ptr<Port>> ports_;
};

}  // namespace tandem::hal::can
