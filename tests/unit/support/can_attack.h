// SPDX-License-Identifier: Apache-2.0
/** @file Random and mutated CAN frames for fuzz tests. */
#pragma once

#include <algorithm>
#include <array>

#include "hal/can/bus.h"
#include "tests/unit/hal/random_frame.h"

namespace tandem::test {

using hal::can::CanFrame;

/// Typical frames of this system's buses, as a basis for faulty ones.
inline CanFrame plausibleFrame(Random& random) {
  const int node = random.integer(1, 7) + (random.chance(0.3) ? 16 : 0);
  constexpr std::uint32_t kBases[] = {0x000, 0x080, 0x180, 0x200, 0x280, 0x300, 0x580, 0x600, 0x700, 0x77F};
  const int kind = random.integer(0, 9);
  CanFrame frame;
  frame.id = kBases[kind] + (kind == 0 || kind == 9 ? 0u : static_cast<std::uint32_t>(node));
  frame.length = static_cast<std::uint8_t>(kind >= 8 ? 1 : kind == 0 ? 2 : kind == 2 || kind == 3 ? 6 : 8);
  for (std::size_t k = 0; k < 8; ++k)
    frame.data[k] = static_cast<std::uint8_t>(random.integer(0, 255));
  if (kind == 6 || kind == 7) {  // an SDO to or from an object that may exist
    constexpr std::uint16_t kObjects[] = {0x1000, 0x1003, 0x1005, 0x1008, 0x1014, 0x1016, 0x1017, 0x1018, 0x1029,
                                          0x1400, 0x1600, 0x1800, 0x1A00, 0x6007, 0x6040, 0x6060, 0x605A, 0x607A,
                                          0x607D, 0x6085, 0x6098, 0x60C2, 0x60FF, 0x6003, 0x6200, 0x6000};
    const std::uint16_t index = kObjects[random.integer(0, 25)];
    frame.data[0] = static_cast<std::uint8_t>(random.chance(0.5) ? random.integer(0, 255)
                                                                 : (random.integer(0, 4) << 5 | random.integer(0, 15)));
    frame.data[1] = static_cast<std::uint8_t>(index);
    frame.data[2] = static_cast<std::uint8_t>(index >> 8);
    frame.data[3] = static_cast<std::uint8_t>(random.integer(0, 8));
  }
  return frame;
}

inline CanFrame mutate(CanFrame frame, Random& random) {
  switch (random.integer(0, 6)) {
    case 0:
      frame.length = static_cast<std::uint8_t>(random.integer(0, 8));
      break;
    case 1:
      frame.remote = true;
      break;
    case 2:
      frame.extended = true;
      break;
    case 3:
      frame.id ^= 1u << random.integer(0, 10);
      break;
    default:
      break;
  }
  return frame;
}

/** Sent frames: first every 11-bit identifier at every length, then random ones. */
class Attack {
 public:
  explicit Attack(std::uint32_t offset) : random_(baseSeed() + offset) {}
  CanFrame next() {
    if (swept_ < kSweep) {
      const int k = swept_++;
      std::array<std::uint8_t, hal::can::kClassicLength> data;
      for (std::uint8_t& byte : data)
        byte = static_cast<std::uint8_t>(random_.integer(0, 255));
      return hal::can::makeFrame(static_cast<std::uint32_t>(k / kLengths), {data.data(), std::size_t(k % kLengths)});
    }
    return random_.chance(0.25) ? randomFrame(random_) : mutate(plausibleFrame(random_), random_);
  }
  Random& random() { return random_; }

 private:
  static constexpr int kLengths = 9, kSweep = 0x800 * kLengths;
  Random random_;
  int swept_ = 0;
};

// Frames that only an intentional master may send: their effects are not part of the fuzz test, which sends them
// truncated.

/// An SDO that starts or continues a download.
inline void spoilDownload(CanFrame& frame, Random& random) {
  if (frame.classicData() && frame.id > 0x600 && frame.id < 0x680 && frame.length == 8 && frame.data[0] >> 5 <= 1)
    frame.length = static_cast<std::uint8_t>(random.integer(0, 7));
}

/// Bus-off is not noise: its receiver stops sending. Other error frames remain, with the error's class, without which
/// the kernel delivers them to no socket.
inline void spoilBusOff(CanFrame& frame) {
  constexpr std::uint32_t kHarmless = 0x7u, kLostArbitration = 0x2u;
  if (frame.error && (frame.id &= kHarmless) == 0)
    frame.id = kLostArbitration;
}

/// An NMT command: any, or only "start".
inline void spoilNmt(CanFrame& frame, Random& random, bool any) {
  constexpr std::uint8_t kCommands[] = {1, 2, 128, 129, 130};
  const bool known = any ? std::ranges::count(kCommands, frame.data[0]) != 0 : frame.data[0] == 1;
  if (frame.classicData() && frame.id == 0 && frame.length == 2 && known)
    frame.length = static_cast<std::uint8_t>(random.integer(0, 1));
}

/// Controlword and target for one of the drives 1 to 6.
inline void spoilSetpoint(CanFrame& frame, Random& random) {
  if (frame.classicData() && frame.id > 0x200 && frame.id <= 0x206 && frame.length >= 6)
    frame.length = static_cast<std::uint8_t>(random.integer(0, 5));
}

/// Reads and discards all frames. @return their number.
inline std::uint64_t drain(hal::can::Bus& bus) {
  std::array<CanFrame, 256> frames;
  std::uint64_t all = 0;
  for (std::size_t count = frames.size(); count == frames.size(); all += count)
    count = bus.receive(frames);
  return all;
}

}  // namespace tandem::test
