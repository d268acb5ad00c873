// SPDX-License-Identifier: Apache-2.0
/** @file CAN network interfaces: settings and state from netlink. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/can/bus.h"

namespace tandem::hal::can {

/** One CAN interface. Values that an interface without a controller (vcan) lacks are empty. */
struct LinkInfo {
  std::string name;
  std::string kind;  ///< "can", "vcan", "vxcan", ...
  int index = 0;
  bool up = false;
  bool fd = false;                             ///< supports CAN FD frames (from its MTU)
  std::uint32_t mtu = 0;                       ///< bytes
  std::uint32_t queue_length = 0;              ///< txqueuelen, frames
  std::optional<std::uint32_t> bit_rate;       ///< bit/s
  std::optional<std::uint32_t> data_bit_rate;  ///< of CAN FD payloads, bit/s
  std::optional<double> sample_point;          ///< fraction of a bit
  std::optional<BusState> state;               ///< of the controller
  std::optional<std::uint32_t> restart_ms;     ///< automatic restart after bus-off; 0: never
  std::optional<std::uint16_t> tx_errors;      ///< error counters
  std::optional<std::uint16_t> rx_errors;
};

/// All CAN interfaces. @throw std::system_error if netlink refuses.
std::vector<LinkInfo> listLinks();
/// One interface; empty if there is no CAN interface of that name. @throw std::system_error.
std::optional<LinkInfo> findLink(const std::string& name);

/** Settings of an interface to change; needs CAP_NET_ADMIN. */
struct LinkChange {
  std::optional<bool> up;
  std::optional<std::uint32_t> bit_rate;      ///< bit/s; only while the interface is down
  std::optional<std::uint32_t> restart_ms;    ///< only while it is down
  std::optional<std::uint32_t> queue_length;  ///< frames
};
/// @throw std::system_error with the kernel's reason.
void changeLink(const std::string& name, const LinkChange& change);

/// Restarts a controller after bus-off. @throw std::system_error, for instance if it is not off.
void restartLink(const std::string& name);

/** Monitors whether one interface is up. */
class LinkMonitor {
 public:
  /// @throw std::system_error if netlink refuses, or there is no such interface.
  explicit LinkMonitor(const std::string& name);
  ~LinkMonitor();
  LinkMonitor(const LinkMonitor&) = delete;
  LinkMonitor& operator=(const LinkMonitor&) = delete;

  /// Processes the pending netlink messages, without waiting. Allocates nothing. @return up().
  bool poll() noexcept;
  bool up() const noexcept { return up_; }
  int index() const noexcept { return index_; }
  std::uint32_t mtu() const noexcept { return mtu_; }

 private:
  int fd_ = -1;
  int index_ = 0;
  bool up_ = false;
  std::uint32_t mtu_ = 0;
};

}  // namespace tandem::hal::can
