// SPDX-License-Identifier: Apache-2.0
/** @file SocketCAN bus (raw socket). */
#pragma once

#include <array>
#include <memory>

#include "hal/can/bus.h"
#include "hal/can/link.h"

namespace tandem::hal::can {

/** SocketCAN. Sends and receives frames in batches (sendmmsg, recvmmsg) with kernel time stamps. Error frames determine
 * state(), netlink reports whether the interface is up. Bus-off stays until restartLink(). */
class SocketCanBus final : public Bus {
 public:
  /// @throw std::system_error if the interface does not exist, is no CAN interface or is down; std::invalid_argument if
  /// CAN FD is requested and the interface does not support it.
  explicit SocketCanBus(const std::string& interface, const BusOptions& options = {});
  ~SocketCanBus() override;

  std::size_t send(std::span<const CanFrame> frames) noexcept override;
  std::size_t receive(std::span<CanFrame> frames) noexcept override;
  int fd() const noexcept override { return fd_; }
  /// State of the interface from netlink.
  const LinkMonitor& link() const noexcept { return link_; }

 private:
  struct Batch;

  void configure(const BusOptions& options);
  std::size_t receiveBatch(std::span<CanFrame> frames) noexcept;
  bool take(std::size_t slot, std::int64_t now, std::int64_t offset, CanFrame& frame) noexcept;
  void pollLink() noexcept;

  LinkMonitor link_;
  int fd_ = -1;
  std::uint32_t overflow_ = 0;  // last value of the kernel's counter
  std::unique_ptr<Batch> batch_;
};

}  // namespace tandem::hal::can
