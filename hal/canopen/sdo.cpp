// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo.h"

#include <algorithm>
#include <cstdio>

#include "hal/canopen/bytes.h"

namespace tandem::hal::canopen {
namespace {

struct AbortText {
  SdoAbort code;
  const char* text;
};
constexpr AbortText kAborts[] = {
    {SdoAbort::kNone, "no abort"},
    {SdoAbort::kToggle, "toggle bit not alternated"},
    {SdoAbort::kTimeout, "time-out"},
    {SdoAbort::kCommand, "command specifier invalid or unknown"},
    {SdoAbort::kBlockSize, "invalid block size"},
    {SdoAbort::kSequence, "invalid sequence number"},
    {SdoAbort::kCrc, "CRC error"},
    {SdoAbort::kMemory, "out of memory"},
    {SdoAbort::kAccess, "unsupported access"},
    {SdoAbort::kWriteOnly, "read of a write-only object"},
    {SdoAbort::kReadOnly, "write to a read-only object"},
    {SdoAbort::kNoObject, "object does not exist"},
    {SdoAbort::kNotMappable, "object cannot be mapped"},
    {SdoAbort::kPdoLength, "mapped objects exceed the PDO length"},
    {SdoAbort::kParameterIncompatible, "parameter incompatibility"},
    {SdoAbort::kInternalIncompatible, "internal incompatibility"},
    {SdoAbort::kHardware, "hardware error"},
    {SdoAbort::kLength, "length does not match"},
    {SdoAbort::kTooLong, "length too high"},
    {SdoAbort::kTooShort, "length too low"},
    {SdoAbort::kNoSubIndex, "sub-index does not exist"},
    {SdoAbort::kValueRange, "value out of range"},
    {SdoAbort::kValueTooHigh, "value too high"},
    {SdoAbort::kValueTooLow, "value too low"},
    {SdoAbort::kMaxBelowMin, "maximum below minimum"},
    {SdoAbort::kNoResource, "resource not available: SDO connection"},
    {SdoAbort::kGeneral, "general error"},
    {SdoAbort::kCannotStore, "data cannot be transferred or stored"},
    {SdoAbort::kLocalControl, "data cannot be transferred or stored because of local control"},
    {SdoAbort::kDeviceState, "data cannot be transferred or stored in the present device state"},
    {SdoAbort::kNoDictionary, "no object dictionary"},
    {SdoAbort::kNoData, "no data available"},
};

CanFrame command(std::uint32_t id, int specifier) noexcept {
  CanFrame frame;
  frame.id = id;
  frame.length = 8;
  frame.data[0] = static_cast<std::uint8_t>(specifier);
  return frame;
}

CanFrame command(std::uint32_t id, int specifier, ObjectAddress object) noexcept {
  CanFrame frame = command(id, specifier);
  frame.data[1] = static_cast<std::uint8_t>(object.index);
  frame.data[2] = static_cast<std::uint8_t>(object.index >> 8);
  frame.data[3] = object.sub;
  return frame;
}

constexpr int toggleBit(bool toggle) noexcept { return toggle ? 0x10 : 0; }

}  // namespace

std::string describe(const ObjectAddress& object) {
  char text[16];
  std::snprintf(text, sizeof text, "%04X:%02X", object.index, object.sub);
  return text;
}

std::string describe(SdoAbort code) {
  char number[16];
  std::snprintf(number, sizeof number, "%08X: ", static_cast<unsigned>(code));
  const auto* found = std::ranges::find(kAborts, code, &AbortText::code);
  return std::string(number) + (found == std::end(kAborts) ? "not a code of CiA 301" : found->text);
}

namespace sdo {

Request requestOf(const CanFrame& frame) noexcept {
  constexpr Request kKinds[] = {Request::kDownloadSegment, Request::kDownload, Request::kUpload,
                                Request::kUploadSegment,   Request::kAbort,    Request::kUnknown,
                                Request::kUnknown,         Request::kUnknown};
  return kKinds[frame.data[0] >> 5];
}

Answer answerOf(const CanFrame& frame) noexcept {
  constexpr Answer kKinds[] = {Answer::kUploadSegment, Answer::kDownloadSegment, Answer::kUpload,  Answer::kDownload,
                               Answer::kAbort,         Answer::kUnknown,         Answer::kUnknown, Answer::kUnknown};
  return kKinds[frame.data[0] >> 5];
}

ObjectAddress objectOf(const CanFrame& frame) noexcept {
  return {static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8), frame.data[3]};
}

SdoAbort abortOf(const CanFrame& frame) noexcept {
  return static_cast<SdoAbort>(fromBytes({frame.data.data() + 4, 4}));
}

bool toggleOf(const CanFrame& frame) noexcept { return (frame.data[0] & 0x10) != 0; }

Initiate parseInitiate(const CanFrame& frame) noexcept {
  Initiate result;
  result.object = objectOf(frame);
  result.expedited = (frame.data[0] & 2) != 0;
  result.size_known = (frame.data[0] & 1) != 0;
  if (result.expedited) {
    result.size = result.size_known ? 4u - ((frame.data[0] >> 2) & 3u) : 4u;
    result.data = {frame.data.data() + 4, result.size};
  } else if (result.size_known) {
    result.size = static_cast<std::uint32_t>(fromBytes({frame.data.data() + 4, 4}));
  }
  return result;
}

Segment parseSegment(const CanFrame& frame) noexcept {
  const std::size_t unused = (frame.data[0] >> 1) & 7;
  return {toggleOf(frame), (frame.data[0] & 1) != 0, {frame.data.data() + 1, 7 - unused}};
}

CanFrame initiate(std::uint32_t id, bool answer, ObjectAddress object, std::span<const std::uint8_t> data) noexcept {
  const int kind = answer ? 0x40 : 0x20;
  if (data.empty() || data.size() > 4) {
    CanFrame frame = command(id, kind | 1, object);
    toBytes(data.size(), {frame.data.data() + 4, 4});
    return frame;
  }
  CanFrame frame = command(id, kind | static_cast<int>(4 - data.size()) << 2 | 3, object);
  std::ranges::copy(data, frame.data.begin() + 4);
  return frame;
}

CanFrame segment(std::uint32_t id, bool toggle, bool last, std::span<const std::uint8_t> data) noexcept {
  const std::size_t count = std::min<std::size_t>(data.size(), 7);
  CanFrame frame = command(id, toggleBit(toggle) | static_cast<int>(7 - count) << 1 | (last ? 1 : 0));
  std::ranges::copy(data.first(count), frame.data.begin() + 1);
  return frame;
}

CanFrame downloadAnswer(std::uint32_t id, ObjectAddress object) noexcept { return command(id, 0x60, object); }
CanFrame downloadSegmentAnswer(std::uint32_t id, bool toggle) noexcept { return command(id, 0x20 | toggleBit(toggle)); }
CanFrame uploadRequest(std::uint32_t id, ObjectAddress object) noexcept { return command(id, 0x40, object); }
CanFrame uploadSegmentRequest(std::uint32_t id, bool toggle) noexcept { return command(id, 0x60 | toggleBit(toggle)); }

CanFrame abort(std::uint32_t id, ObjectAddress object, SdoAbort code) noexcept {
  CanFrame frame = command(id, 0x80, object);
  toBytes(static_cast<std::uint32_t>(code), {frame.data.data() + 4, 4});
  return frame;
}

}  // namespace sdo
}  // namespace tandem::hal::canopen
