// SPDX-License-Identifier: Apache-2.0
/** @file SDO client: one transfer at a time with one node, as a state machine without clock, socket or thread. */
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/canopen/sdo.h"

namespace tandem::hal::canopen {

/** State of the last transfer. */
enum class SdoStatus : std::uint8_t {
  kIdle = 0,  ///< no transfer yet
  kBusy,
  kDone,
  kAborted,  ///< by the node, or by us: abort() has the code
};

/** Use: start a transfer, send the frame of request(), feed received frames, poll the time. Times are ns on the
 * caller's clock. */
class SdoClient {
 public:
  /// Largest transfer, bytes.
  static constexpr std::size_t kCapacity = 1024;
  /// Longest wait of a request until the bus accepts it, ns: on a busy bus the nodes take turns.
  static constexpr std::int64_t kTurn = 2'000'000'000;

  /// @param node 1..127; @param timeout longest wait for an answer, ns; @param retries how often a transfer without
  /// answer restarts before it counts as timed out. A write may then happen twice.
  SdoClient(int node, std::int64_t timeout, int retries = 0) noexcept;

  /** Starts a write. A running transfer is aborted with an abort frame.
   * @return false: more than kCapacity bytes, no transfer started. */
  bool download(ObjectAddress object, std::span<const std::uint8_t> data, std::int64_t now) noexcept;
  /// ... a number of `size` bytes (1..8).
  bool download(ObjectAddress object, std::uint64_t value, int size, std::int64_t now) noexcept;
  /// Starts a read. A running transfer is aborted with an abort frame.
  void upload(ObjectAddress object, std::int64_t now) noexcept;
  /// The present transfer does not wait for those of other nodes (Network).
  void setUrgent() noexcept { urgent_ = true; }
  bool urgent() const noexcept { return urgent_; }
  /// Aborts a running transfer.
  void cancel(SdoAbort reason = SdoAbort::kGeneral) noexcept;
  /// Clears all state: the node was reset and has no transfer.
  void reset() noexcept;

  /** Processes a frame. @return false: it is no answer of this node. Unexpected answers are ignored and counted in
   * unexpectedResponses(). */
  bool feed(const CanFrame& frame, std::int64_t now) noexcept;
  /// Detects a time-out, and restarts the transfer while retries are left.
  void poll(std::int64_t now) noexcept;
  /// Next frame to send; nullptr: none. It stays until sent() confirms that the bus has accepted it.
  const CanFrame* request() const noexcept { return outgoing_count_ > 0 ? outgoing_.data() : nullptr; }
  /// The request was sent: the time-out for its answer starts now.
  void sent(std::int64_t now) noexcept;

  int node() const noexcept { return node_; }
  SdoStatus status() const noexcept { return status_; }
  bool busy() const noexcept { return status_ == SdoStatus::kBusy; }
  ObjectAddress object() const noexcept { return object_; }
  SdoAbort abort() const noexcept { return abort_; }
  /// Result of a read; valid while status() is kDone, until the next transfer.
  std::span<const std::uint8_t> data() const noexcept { return {buffer_.data(), size_}; }
  /// ... as an unsigned number of up to 8 bytes.
  std::uint64_t value() const noexcept;
  /** ... as an unsigned number of an object of `size` bytes (1 to 8; 0: as many as were sent). A server may send more
   * bytes than the object has: four without saying how many of them count (command 0x42), or a number that is extended
   * by zeros or by its sign (0x43 for an object of two bytes).
   * @param[out] fits  false: the bytes beyond the object are part of a larger number; all of it is returned. */
  std::uint64_t value(int size, bool& fits) const noexcept;
  std::uint64_t unexpectedResponses() const noexcept { return unexpected_responses_; }

 private:
  enum class Phase : std::uint8_t { kInitiate, kSegments };

  std::uint32_t requestId() const noexcept;
  void begin(ObjectAddress object, bool upload) noexcept;
  /// Sends the request of the transfer that begin() has set up.
  void open(std::int64_t now) noexcept;
  void push(const CanFrame& frame) noexcept;
  void fail(SdoAbort code, bool send_abort) noexcept;
  void onDownloadAnswer(const CanFrame& frame) noexcept;
  void onDownloadSegmentAnswer(const CanFrame& frame) noexcept;
  void onUploadAnswer(const CanFrame& frame) noexcept;
  void onUploadSegment(const CanFrame& frame) noexcept;
  void sendSegment() noexcept;

  int node_;
  std::int64_t timeout_;
  int retries_;
  int retried_ = 0;  ///< of this transfer
  std::int64_t deadline_ = 0;
  SdoStatus status_ = SdoStatus::kIdle;
  Phase phase_ = Phase::kInitiate;
  bool upload_ = false;
  bool urgent_ = false;
  bool toggle_ = false;
  bool announced_ = false;  ///< the server reported the size
  bool all_count_ = true;   ///< every byte received belongs to the object
  ObjectAddress object_;
  SdoAbort abort_ = SdoAbort::kNone;
  std::array<std::uint8_t, kCapacity> buffer_{};
  std::size_t size_ = 0;                ///< of the transfer; in an upload: bytes so far
  std::size_t position_ = 0;            ///< in a download: bytes in segments sent
  std::size_t expected_ = 0;            ///< in an upload: reported size
  std::array<CanFrame, 2> outgoing_{};  ///< an abort of the previous transfer, and a request
  std::size_t outgoing_count_ = 0;
  std::uint64_t unexpected_responses_ = 0;
};

}  // namespace tandem::hal::canopen
