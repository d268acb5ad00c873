// SPDX-License-Identifier: Apache-2.0
/** @file Emulated CAN bus over AF_UNIX SEQPACKET sockets, for kernels without CAN and for sanitizer builds.
 *
 * One participant is the hub: it listens at a path, and forwards the frames of each participant to all others, in the
 * same order for all, when its receive() is called. A participant that does not fetch its frames loses those that do
 * not fit into its queue; the hub counts them. */
#pragma once

#include <array>

#include "hal/can/bus.h"

namespace tandem::hal::can {

/** Joins a hub. When the hub ends, state() is kDown until it is back: receive() tries to connect every 100 ms. */
class SeqpacketBus final : public Bus {
 public:
  /// @throw std::system_error if no hub listens at the path.
  explicit SeqpacketBus(const std::string& path, const BusOptions& options = {});
  ~SeqpacketBus() override;

  std::size_t send(std::span<const CanFrame> frames) noexcept override;
  std::size_t receive(std::span<CanFrame> frames) noexcept override;
  /// An epoll descriptor that stays the same when the hub ends and restarts.
  int fd() const noexcept override { return poll_; }

 private:
  bool connect() noexcept;
  void disconnect() noexcept;

  std::string path_;
  int poll_ = -1;
  int fd_ = -1;
  std::int64_t next_attempt_ = 0;
};

/** Hub and participant at once, for up to kMaxPeers others. */
class SeqpacketHub final : public Bus {
 public:
  static constexpr std::size_t kMaxPeers = 16;

  /// Listens; replaces the socket file of a hub that has ended. @throw std::system_error, for instance EADDRINUSE.
  explicit SeqpacketHub(const std::string& path, const BusOptions& options = {});
  /// Closes all connections and removes the socket file.
  ~SeqpacketHub() override;

  std::size_t send(std::span<const CanFrame> frames) noexcept override;
  std::size_t receive(std::span<CanFrame> frames) noexcept override;
  int fd() const noexcept override { return poll_; }
  /// Other participants connected now.
  std::size_t peers() const noexcept { return peer_count_; }
  /// Frames lost because the queue of a participant was full.
  std::uint64_t undelivered() const noexcept { return undelivered_; }

 private:
  void accept() noexcept;
  void drop(std::size_t peer) noexcept;
  void forward(const void* packet, std::size_t length, int from) noexcept;

  std::string path_;
  int poll_ = -1;
  int listener_ = -1;
  std::array<int, kMaxPeers> peers_{};
  std::size_t peer_count_ = 0;
  std::uint64_t undelivered_ = 0;
};

}  // namespace tandem::hal::can
