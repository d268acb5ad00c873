// SPDX-License-Identifier: Apache-2.0
/** @file CAN bus interface of the HAL and the simulated drives: frames, counters, state. */
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/can/frame.h"
#include "idl/enumerations.h"

namespace tandem::hal::can {

using idl::BusState;
using idl::name;

/** Counters of one bus since it was opened. */
struct BusCounters {
  std::uint64_t sent = 0;         ///< frames that the kernel accepted
  std::uint64_t received = 0;     ///< frames handed to the caller, error frames included
  std::uint64_t data_bytes = 0;   ///< payload of the frames in `sent` and `received`, without error frames
  std::uint64_t tx_dropped = 0;   ///< frames dropped because the transmit queue was full
  std::uint64_t tx_failed = 0;    ///< frames refused for another reason (link down, length)
  std::uint64_t rx_overflow = 0;  ///< frames that the kernel dropped because its receive queue was full
  std::uint64_t rx_invalid = 0;   ///< received packets that are not frames
  std::uint64_t rx_failed = 0;    ///< reads that failed (link down)
  std::uint64_t error_frames = 0;
  std::uint64_t bus_off = 0;      ///< changes of the controller to bus-off
  std::uint64_t restarts = 0;     ///< returns of the controller from bus-off
  std::uint64_t link_losses = 0;  ///< losses of the link (interface down)
  std::uint8_t tx_errors = 0;     ///< error counters of the controller, if it reports them
  std::uint8_t rx_errors = 0;
};

/** Accepts frames with (id & mask) == (filter id & mask). */
struct Filter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0x7FF;
  bool extended = false;  ///< 29-bit frames; false: 11-bit frames
};

struct BusOptions {
  std::vector<Filter> filters;     ///< empty: all frames
  bool fd = false;                 ///< CAN FD frames too; the interface must support it
  int receive_buffer = 1 << 20;    ///< bytes; the kernel counts about 450 per frame
  int max_consecutive_drops = 10;  ///< consecutive calls of send() with drops after which the bus is faulty
};

/** One endpoint of a bus. Not thread-safe. No member allocates, blocks, or throws once the bus is open. */
class Bus {
 public:
  virtual ~Bus() = default;

  /** Sends frames in order. If the queue is full, the frame and those after it are dropped and counted: the setpoint of
   * the next cycle supersedes them.
   * @return number of accepted frames, from the front. */
  virtual std::size_t send(std::span<const CanFrame> frames) noexcept = 0;

  /// Gets the received frames, without waiting. @return number of filled `frames`; if all are filled, call again.
  virtual std::size_t receive(std::span<CanFrame> frames) noexcept = 0;

  /// Descriptor for poll(): readable when receive() has something to do. -1: none.
  virtual int fd() const noexcept = 0;

  BusState state() const noexcept { return state_; }
  const BusCounters& counters() const noexcept { return counters_; }
  /// No setpoint is sent any more: bus-off, link down, or max_consecutive_drops reached.
  bool faulty() const noexcept;
  /// Consecutive calls of send() with drops.
  int consecutiveDrops() const noexcept { return consecutive_drops_; }
  const std::string& name() const noexcept { return name_; }
  /// Largest payload, bytes: 8, or 64 with CAN FD.
  std::size_t maxLength() const noexcept { return fd_frames_ ? kFdLength : kClassicLength; }

 protected:
  Bus(std::string name, const BusOptions& options);

  void noteState(BusState state) noexcept;         ///< counts changes to and from bus-off, and link losses
  void noteError(const CanFrame& frame) noexcept;  ///< an error frame: counters and state
  void noteSend(std::span<const CanFrame> taken, std::size_t dropped, std::size_t failed) noexcept;
  void noteReceived(std::span<const CanFrame> frames) noexcept;
  bool accepts(const CanFrame& frame) const noexcept;  ///< the frame passes the filters

  BusCounters counters_;
  bool fd_frames_ = false;

 private:
  std::string name_;
  std::vector<Filter> filters_;
  int max_consecutive_drops_;
  int consecutive_drops_ = 0;
  BusState state_ = BusState::kActive;
};

/** Opens "can:INTERFACE" (SocketCAN), "unix:PATH" (joins the hub at that socket) or "unix-hub:PATH" (is the hub).
 * @throw std::invalid_argument for another address, std::system_error if the kernel refuses. */
std::unique_ptr<Bus> openBus(const std::string& address, const BusOptions& options = {});

}  // namespace tandem::hal::can
