// SPDX-License-Identifier: Apache-2.0
/** @file SDO frames (CiA 301, expedited and segmented) and abort codes: the codec that client and server share. */
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "hal/can/frame.h"

namespace tandem::hal::canopen {

using can::CanFrame;

/** Index and subindex of an object in a dictionary. */
struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  friend constexpr bool operator==(const ObjectAddress&, const ObjectAddress&) = default;
  friend constexpr auto operator<=>(const ObjectAddress&, const ObjectAddress&) = default;
};
/// "6040:00".
std::string describe(const ObjectAddress& object);

/** Abort codes of CiA 301. A server may also send other values. */
enum class SdoAbort : std::uint32_t {
  kNone = 0,
  kToggle = 0x05030000,
  kTimeout = 0x05040000,
  kCommand = 0x05040001,
  kBlockSize = 0x05040002,
  kSequence = 0x05040003,
  kCrc = 0x05040004,
  kMemory = 0x05040005,
  kAccess = 0x06010000,
  kWriteOnly = 0x06010001,
  kReadOnly = 0x06010002,
  kNoObject = 0x06020000,
  kNotMappable = 0x06040041,
  kPdoLength = 0x06040042,
  kParameterIncompatible = 0x06040043,
  kInternalIncompatible = 0x06040047,
  kHardware = 0x06060000,
  kLength = 0x06070010,
  kTooLong = 0x06070012,
  kTooShort = 0x06070013,
  kNoSubIndex = 0x06090011,
  kValueRange = 0x06090030,
  kValueTooHigh = 0x06090031,
  kValueTooLow = 0x06090032,
  kMaxBelowMin = 0x06090036,
  kNoResource = 0x060A0023,
  kGeneral = 0x08000000,
  kCannotStore = 0x08000020,
  kLocalControl = 0x08000021,
  kDeviceState = 0x08000022,
  kNoDictionary = 0x08000023,
  kNoData = 0x08000024,
};
/// "06090031: value too high".
std::string describe(SdoAbort code);
/// The node does not have the object.
constexpr bool isAbsence(SdoAbort code) noexcept {
  return code == SdoAbort::kNoObject || code == SdoAbort::kNoSubIndex;
}
/// The node has the object, but does not take the value: read-only, or outside its range.
constexpr bool isRefusal(SdoAbort code) noexcept {
  return code == SdoAbort::kReadOnly || code == SdoAbort::kValueRange || code == SdoAbort::kValueTooHigh ||
         code == SdoAbort::kValueTooLow;
}

namespace sdo {

/** Type of an SDO frame, for client and server. Client requests and server answers use different specifiers. */
enum class Request : std::uint8_t { kDownload, kDownloadSegment, kUpload, kUploadSegment, kAbort, kUnknown };
enum class Answer : std::uint8_t { kDownload, kDownloadSegment, kUpload, kUploadSegment, kAbort, kUnknown };
Request requestOf(const CanFrame& frame) noexcept;
Answer answerOf(const CanFrame& frame) noexcept;

/** First frame of a transfer with data or its size: download request or upload answer. */
struct Initiate {
  ObjectAddress object;
  bool expedited = false;
  bool size_known = false;
  std::uint32_t size = 0;              ///< bytes; of an expedited one without size: 4
  std::span<const std::uint8_t> data;  ///< of an expedited one; points into the frame
};
Initiate parseInitiate(const CanFrame& frame) noexcept;

/** A frame that carries up to seven bytes. */
struct Segment {
  bool toggle = false;
  bool last = false;
  std::span<const std::uint8_t> data;  ///< points into the frame
};
Segment parseSegment(const CanFrame& frame) noexcept;

ObjectAddress objectOf(const CanFrame& frame) noexcept;
SdoAbort abortOf(const CanFrame& frame) noexcept;
bool toggleOf(const CanFrame& frame) noexcept;  ///< of a segment request or acknowledgement

/// Download request (`answer` false) or upload answer (true) for a transfer of so many bytes; includes the data up to 4
/// bytes.
CanFrame initiate(std::uint32_t id, bool answer, ObjectAddress object, std::span<const std::uint8_t> data) noexcept;
/// Download segment (`answer` false) or upload segment (true); up to 7 bytes.
CanFrame segment(std::uint32_t id, bool toggle, bool last, std::span<const std::uint8_t> data) noexcept;
CanFrame downloadAnswer(std::uint32_t id, ObjectAddress object) noexcept;
CanFrame downloadSegmentAnswer(std::uint32_t id, bool toggle) noexcept;
CanFrame uploadRequest(std::uint32_t id, ObjectAddress object) noexcept;
CanFrame uploadSegmentRequest(std::uint32_t id, bool toggle) noexcept;
CanFrame abort(std::uint32_t id, ObjectAddress object, SdoAbort code) noexcept;

}  // namespace sdo
}  // namespace tandem::hal::canopen
