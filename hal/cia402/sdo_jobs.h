// SPDX-License-Identifier: Apache-2.0
/** @file Queue of SDO accesses to one running node, without allocation. */
#pragma once

#include <array>
#include <cstdint>

#include "hal/canopen/node.h"

namespace tandem::hal {

/** Writes with read-back, and reads that are repeated until they return a value. */
class SdoJobs {
 public:
  enum class Status : std::uint8_t { kIdle, kBusy, kDone, kFailed };

  /// @param urgent  the accesses do not wait for those to other nodes.
  explicit SdoJobs(bool urgent = false) noexcept : urgent_(urgent) {}
  /// Removes all jobs; the next step aborts a running transfer.
  void clear() noexcept;
  /// Writes a number of `size` bytes (1..4) and reads it back.
  void write(canopen::ObjectAddress object, std::int64_t value, int size) noexcept;
  /// Reads until the object has the value, for at most `timeout` ns.
  void await(canopen::ObjectAddress object, std::int64_t value, int size, std::int64_t timeout) noexcept;
  /// Reads once; value() has the result when done.
  void read(canopen::ObjectAddress object) noexcept;

  /// Advances the jobs. kDone when all are done, kFailed at the first abort, difference or time-out.
  Status step(canopen::Node& node, std::int64_t now) noexcept;
  Status status() const noexcept { return status_; }
  /// Last value read.
  std::uint64_t value() const noexcept { return value_; }
  /// Abort code of a failure; kNone: the value read differs.
  canopen::SdoAbort abort() const noexcept { return abort_; }

 private:
  static constexpr std::size_t kCapacity = 12;
  enum class Kind : std::uint8_t { kWrite, kAwait, kRead };
  struct Job {
    Kind kind = Kind::kRead;
    canopen::ObjectAddress object;
    std::uint64_t value = 0;
    int size = 0;
    std::int64_t timeout = 0;
  };
  void push(const Job& job) noexcept;
  void begin(canopen::SdoClient& sdo, std::int64_t now) noexcept;
  void finish(canopen::SdoClient& sdo, std::int64_t now) noexcept;
  void fail(canopen::SdoAbort abort) noexcept;

  bool urgent_;
  std::array<Job, kCapacity> jobs_{};
  std::size_t count_ = 0;
  std::size_t next_ = 0;
  bool running_ = false;       ///< a transfer of this queue is running
  bool reading_back_ = false;  ///< the write is done, the read-back is not
  std::int64_t deadline_ = 0;  ///< of an await, 0: not started
  Status status_ = Status::kIdle;
  canopen::SdoAbort abort_ = canopen::SdoAbort::kNone;
  std::uint64_t value_ = 0;
};

}  // namespace tandem::hal
