// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/emcy.h"

#include <algorithm>
#include <cstdio>

#include "hal/canopen/bytes.h"

namespace tandem::hal::canopen {
namespace {

struct CodeText {
  std::uint16_t code;
  const char* text;
};
constexpr CodeText kCodes[] = {
    {error_code::kNone, "no error"},
    {error_code::kOverCurrent, "over-current"},
    {error_code::kShortCircuit, "short circuit"},
    {error_code::kOverVoltage, "supply voltage too high"},
    {error_code::kUnderVoltage, "supply voltage too low"},
    {error_code::kDeviceTemperature, "device too hot"},
    {error_code::kDriveTemperature, "drive too hot"},
    {error_code::kHardware, "hardware of the device"},
    {error_code::kParameter, "parameter error"},
    {error_code::kBlocked, "motor blocked"},
    {error_code::kEncoder, "position encoder"},
    {error_code::kOverrun, "CAN overrun: frames lost"},
    {error_code::kErrorPassive, "CAN controller error passive"},
    {error_code::kHeartbeat, "heartbeat of the master lost"},
    {error_code::kBusOffRecovered, "recovered from bus-off"},
    {error_code::kIdCollision, "two nodes with one id"},
    {error_code::kPdoLength, "PDO too short"},
    {error_code::kPdoLengthExceeded, "PDO too long"},
    {error_code::kSyncLength, "unexpected length of SYNC"},
    {error_code::kRpdoTimeout, "no command PDO within its deadline"},
    {error_code::kFollowingError, "following error"},
};
/// Classes of CiA 301 by the high byte, whose low nibble may be arbitrary.
constexpr CodeText kClasses[] = {
    {0x0000, "error reset or no error"},
    {0x1000, "generic error"},
    {0x2000, "current"},
    {0x2100, "current, input side"},
    {0x2200, "current inside the device"},
    {0x2300, "current, output side"},
    {0x3000, "voltage"},
    {0x3100, "mains voltage"},
    {0x3200, "voltage inside the device"},
    {0x3300, "output voltage"},
    {0x4000, "temperature"},
    {0x4100, "ambient temperature"},
    {0x4200, "device temperature"},
    {0x4300, "drive temperature"},
    {0x5000, "device hardware"},
    {0x6000, "device software"},
    {0x6100, "internal software"},
    {0x6200, "user software"},
    {0x6300, "data set"},
    {0x7000, "additional modules"},
    {0x7100, "power section"},
    {0x7300, "sensor"},
    {0x8000, "monitoring"},
    {0x8100, "communication"},
    {0x8200, "protocol"},
    {0x8600, "positioning"},
    {0x9000, "external error"},
    {0xF000, "additional functions"},
    {0xFF00, "manufacturer specific"},
};

template <std::size_t N>
const char* find(const CodeText (&table)[N], int code) {
  const auto* found = std::ranges::find(table, code, &CodeText::code);
  return found == std::end(table) ? nullptr : found->text;
}

}  // namespace

std::optional<Emcy> parseEmcy(const CanFrame& frame) noexcept {
  if (!frame.classicData() || frame.length != 8)
    return std::nullopt;
  Emcy emcy;
  emcy.code = static_cast<std::uint16_t>(fromBytes({frame.data.data(), 2}));
  emcy.error_register = frame.data[2];
  std::copy_n(frame.data.begin() + 3, 5, emcy.manufacturer.begin());
  return emcy;
}

CanFrame emcyFrame(std::uint32_t id, const Emcy& emcy) noexcept {
  CanFrame frame;
  frame.id = id;
  frame.length = 8;
  toBytes(emcy.code, {frame.data.data(), 2});
  frame.data[2] = emcy.error_register;
  std::ranges::copy(emcy.manufacturer, frame.data.begin() + 3);
  return frame;
}

std::string describeErrorCode(std::uint16_t code) {
  char number[8];
  std::snprintf(number, sizeof number, "%04X: ", code);
  const char* text = find(kCodes, code);
  if (text == nullptr)
    text = find(kClasses, code & 0xFF00);
  if (text == nullptr)
    text = find(kClasses, code & 0xF000);
  return std::string(number) + (text == nullptr ? "not a class of CiA 301" : text);
}

}  // namespace tandem::hal::canopen
