// SPDX-License-Identifier: Apache-2.0
/** @file SDO server of a simulated device: expedited and segmented transfers, one at a time. */
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/canopen/sdo.h"

namespace tandem::sim::drives {

using hal::can::CanFrame;
using hal::canopen::ObjectAddress;
using hal::canopen::SdoAbort;

/** Access of the server to the object dictionary. */
class SdoAccess {
 public:
  virtual ~SdoAccess() = default;
  /// Writes the object's bytes into `bytes`. @param size in: space, out: bytes written.
  virtual SdoAbort readObject(ObjectAddress object, std::span<std::uint8_t> bytes, std::size_t& size) = 0;
  virtual SdoAbort writeObject(ObjectAddress object, std::span<const std::uint8_t> bytes) = 0;
};

/** Forms of an expedited answer to a read that CiA 301 permits for a number of up to four bytes. */
enum class AnswerForm : std::uint8_t {
  kSized,      ///< its bytes, and how many there are (commands 0x43 to 0x4F)
  kUnsized,    ///< four bytes, without saying how many of them count (0x42); the others are not zero
  kFourBytes,  ///< always four bytes (0x43), the number extended by its sign
};

class SdoServer {
 public:
  AnswerForm form = AnswerForm::kSized;
  static constexpr std::size_t kCapacity = 1024;                  ///< bytes of a transfer
  static constexpr std::int64_t kSegmentTimeout = 1'000'000'000;  ///< between two segments, ns

  SdoServer(std::uint8_t node, SdoAccess& access) noexcept : node_(node), access_(access) {}

  /// Processes a request. @return false: no answer to send.
  bool handle(const CanFrame& request, std::int64_t now, CanFrame& answer) noexcept;
  /// Aborts a transfer after its time-out. @return true: `answer` is the abort to send.
  bool poll(std::int64_t now, CanFrame& answer) noexcept;
  void reset() noexcept { mode_ = Mode::kIdle; }

 private:
  enum class Mode : std::uint8_t { kIdle, kDownload, kUpload };

  std::uint32_t id() const noexcept;
  CanFrame refuse(SdoAbort code) noexcept;
  CanFrame beginDownload(const CanFrame& request) noexcept;
  CanFrame beginUpload(const CanFrame& request) noexcept;
  CanFrame expedited() noexcept;
  CanFrame takeSegment(const CanFrame& request) noexcept;
  CanFrame giveSegment(const CanFrame& request) noexcept;

  std::uint8_t node_;
  SdoAccess& access_;
  Mode mode_ = Mode::kIdle;
  ObjectAddress object_;
  bool toggle_ = false;
  std::array<std::uint8_t, kCapacity> buffer_{};
  std::size_t size_ = 0;      ///< announced size of a download (0: not reported), size of an upload
  std::size_t position_ = 0;  ///< bytes so far
  std::int64_t deadline_ = 0;
};

}  // namespace tandem::sim::drives
