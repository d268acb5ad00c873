// SPDX-License-Identifier: Apache-2.0
/** @file Emergency messages (CiA 301) and the error codes of drives (CiA 402, object 603F). */
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/can/frame.h"

namespace tandem::hal::canopen {

using can::CanFrame;

/// Error codes that the HAL or the simulated drives use.
namespace error_code {
inline constexpr std::uint16_t kNone = 0x0000;
inline constexpr std::uint16_t kOverCurrent = 0x2310;
inline constexpr std::uint16_t kShortCircuit = 0x2320;
inline constexpr std::uint16_t kOverVoltage = 0x3210;
inline constexpr std::uint16_t kUnderVoltage = 0x3220;
inline constexpr std::uint16_t kDeviceTemperature = 0x4210;
inline constexpr std::uint16_t kDriveTemperature = 0x4310;
inline constexpr std::uint16_t kHardware = 0x5000;
inline constexpr std::uint16_t kParameter = 0x6320;
inline constexpr std::uint16_t kBlocked = 0x7121;
inline constexpr std::uint16_t kEncoder = 0x7305;
inline constexpr std::uint16_t kOverrun = 0x8110;
inline constexpr std::uint16_t kErrorPassive = 0x8120;
inline constexpr std::uint16_t kHeartbeat = 0x8130;
inline constexpr std::uint16_t kBusOffRecovered = 0x8140;
inline constexpr std::uint16_t kIdCollision = 0x8150;
inline constexpr std::uint16_t kPdoLength = 0x8210;
inline constexpr std::uint16_t kPdoLengthExceeded = 0x8220;
inline constexpr std::uint16_t kSyncLength = 0x8240;
inline constexpr std::uint16_t kRpdoTimeout = 0x8250;
inline constexpr std::uint16_t kFollowingError = 0x8611;
}  // namespace error_code

/** One emergency message. */
struct Emcy {
  std::uint16_t code = 0;           ///< 0: the error is over
  std::uint8_t error_register = 0;  ///< object 1001
  std::array<std::uint8_t, 5> manufacturer{};
};

/// Empty unless the frame has eight bytes.
std::optional<Emcy> parseEmcy(const CanFrame& frame) noexcept;
/// @param id COB-ID, 0x80 + node by default.
CanFrame emcyFrame(std::uint32_t id, const Emcy& emcy) noexcept;
/// "8611: following error"; of an unknown code its class, as CiA 301 defines it.
std::string describeErrorCode(std::uint16_t code);

}  // namespace tandem::hal::canopen
