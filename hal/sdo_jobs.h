// SPDX-License-Identifier: Apache-2.0
/** @file Queue of SDO accesses to one running node, without allocation. */
#pragma once

#include <array>
#include <cstdint>

#include "hal/canopen/node.h"

namespace tandem::hal {

/** Writes that are read back, and reads that are repeated until a value shows. */
class SdoJobs {
 public:
  enum class Status : std::uint8_t { kIdle, kBusy, kDone, kFailed };

  /// Forgets everything; a transfer that runs is given up with the next step.
  void clear() noexcept;
  /// Writes a number of `size` bytes (1..4) and reads it back.
  void write(canopen::ObjectAddress object, std::int64_t value, int size) noexcept;
  /// Reads until the value is there, at most `timeout` ns.
  void await(canopen::ObjectAddress object, std::int64_t value, int size, std::int64_t timeout) noexcept;
  /// Reads once; value() has it when done.
  void read(canopen::ObjectAddress object) noexcept;

  /// Goes on. kDone once everything is done, kFailed at the first refusal, difference or time-out.
  Status step(canopen::Node& node, std::int64_t now) noexcept;
  Status status() const noexcept { return status_; }
  /// What was read last.
  std::uint64_t value() const noexcept { return value_; }
  /// The abort code of a failure; kNone: another value was read.
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

  std::array<Job, kCapacity> jobs_{};
  std::size_t count_ = 0;
  std::size_t next_ = 0;
  bool running_ = false;       ///< a transfer of ours
  bool reading_back_ = false;  ///< the write is done
  std::int64_t deadline_ = 0;  ///< of an await, 0: not begun
  Status status_ = Status::kIdle;
  canopen::SdoAbort abort_ = canopen::SdoAbort::kNone;
  std::uint64_t value_ = 0;
};

}  // namespace tandem::hal
