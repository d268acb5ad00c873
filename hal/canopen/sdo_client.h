// SPDX-License-Identifier: Apache-2.0
/** @file SDO client: one transfer at a time with one node, as a state machine without clock, socket or thread. */
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/canopen/sdo.h"

namespace tandem::hal::canopen {

/** How the last transfer stands. */
enum class SdoStatus : std::uint8_t {
  kIdle = 0,  ///< there was none
  kBusy,
  kDone,
  kAborted,  ///< by the node, or by us: abort() says why
};

/** Start a transfer, send what takeRequest() gives, feed what comes, poll the time. Times are ns on the caller's
 * clock. */
class SdoClient {
 public:
  /// Largest transfer, bytes.
  static constexpr std::size_t kCapacity = 1024;

  /// @param node 1..127; @param timeout longest wait for an answer, ns; @param retries how often a transfer whose
  /// answer got lost begins anew before it counts as timed out. A write may then happen twice.
  SdoClient(int node, std::int64_t timeout, int retries = 0) noexcept;

  /** Begins to write. A transfer that is still running is given up with an abort frame.
   * @return false: more than kCapacity bytes, nothing was begun. */
  bool download(ObjectAddress object, std::span<const std::uint8_t> data, std::int64_t now) noexcept;
  /// ... a number of `size` bytes (1..8).
  bool download(ObjectAddress object, std::uint64_t value, int size, std::int64_t now) noexcept;
  /// Begins to read. A transfer that is still running is given up with an abort frame.
  void upload(ObjectAddress object, std::int64_t now) noexcept;
  /// Gives a running transfer up.
  void cancel(SdoAbort reason = SdoAbort::kGeneral) noexcept;
  /// Forgets everything: the node was reset and knows of no transfer.
  void reset() noexcept;

  /** Takes a frame. @return false: it is no answer of this node. Answers that nobody waits for are ignored and counted
   * in unexpectedResponses(). */
  bool feed(const CanFrame& frame, std::int64_t now) noexcept;
  /// Notices a time-out, and begins anew where retries are left.
  void poll(std::int64_t now) noexcept;
  /// The frame to send next, nothing pending: nullptr. It stays until sent() says that the bus took it.
  const CanFrame* request() const noexcept { return outgoing_count_ > 0 ? outgoing_.data() : nullptr; }
  /// The request went out: the wait for its answer begins now.
  void sent(std::int64_t now) noexcept;

  int node() const noexcept { return node_; }
  SdoStatus status() const noexcept { return status_; }
  bool busy() const noexcept { return status_ == SdoStatus::kBusy; }
  ObjectAddress object() const noexcept { return object_; }
  SdoAbort abort() const noexcept { return abort_; }
  /// What was read; valid while status() is kDone, until the next transfer.
  std::span<const std::uint8_t> data() const noexcept { return {buffer_.data(), size_}; }
  /// ... as an unsigned number of up to 8 bytes.
  std::uint64_t value() const noexcept;
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
  bool toggle_ = false;
  bool announced_ = false;  ///< the server reported the size
  ObjectAddress object_;
  SdoAbort abort_ = SdoAbort::kNone;
  std::array<std::uint8_t, kCapacity> buffer_{};
  std::size_t size_ = 0;                ///< of the transfer; of an upload: bytes so far
  std::size_t position_ = 0;            ///< of a download: bytes in segments sent
  std::size_t expected_ = 0;            ///< of an upload whose size was reported
  std::array<CanFrame, 2> outgoing_{};  ///< an abort of the transfer before, and a request
  std::size_t outgoing_count_ = 0;
  std::uint64_t unexpected_responses_ = 0;
};

}  // namespace tandem::hal::canopen
