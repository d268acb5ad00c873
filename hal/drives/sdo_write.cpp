// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/sdo_write.h"

#include <algorithm>
#include <array>

namespace tandem::hal {

std::string forbidden(const SdoWrite& write) {
  // CiA 301, and CiA 402-2: controlword, mode, targets, offsets, digital outputs.
  constexpr std::array<std::uint16_t, 2> kCommunication{0x1006, 0x1007};
  constexpr std::array<std::uint16_t, 9> kCommands{0x6040, 0x6042, 0x6060, 0x6071, 0x607A,
                                                   0x60B0, 0x60B1, 0x60B2, 0x60FF};
  constexpr std::uint16_t kOutputs = 0x60FE, kInterpolated = 0x60C1;
  if (std::ranges::find(kCommands, write.index) != kCommands.end() || write.index == kInterpolated)
    return "which commands the drive";
  if (write.index == kOutputs)
    return "the digital outputs, which may open a brake; see `brake`";
  if (write.index < 0x1000)
    return "which is a data type";
  if (write.index < 0x2000 && std::ranges::find(kCommunication, write.index) == kCommunication.end())
    return "of the communication, which the HAL sets";
  return {};
}

}  // namespace tandem::hal
