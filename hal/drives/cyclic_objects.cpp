// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/cyclic_objects.h"

namespace tandem::hal {

std::vector<CyclicObject> commandObjects(const AxisConfig& axis) {
  const std::uint16_t target = targetIsVelocity(axis.mode) ? 0x60FF : 0x607A;
  return {{0x6040, 0, 16}, {target, 0, 32}};
}

std::vector<CyclicObject> feedbackObjects(const HardwareConfig& hardware, const AxisConfig& axis) {
  std::vector<CyclicObject> objects{{0x6041, 0, 16}, {0x6064, 0, 32}};
  if (axis.feedbackTorque() != 0)
    objects.push_back({axis.feedbackTorque(), 0, 16});
  if (axis.encoder && axis.encoder->atDrive())
    objects.push_back({0x60E4, static_cast<std::uint8_t>(axis.encoder->drive_input), 32});
  if (readsInputs(hardware, axis))
    objects.push_back({0x60FD, 0, 32});
  return objects;
}

std::vector<std::vector<CyclicObject>> packPdos(const std::vector<CyclicObject>& objects, int most_objects) {
  constexpr int kMostBits = 64;
  std::vector<std::vector<CyclicObject>> pdos;
  int bits = 0;
  for (const CyclicObject& object : objects) {
    if (pdos.empty() || bits + object.bits > kMostBits || static_cast<int>(pdos.back().size()) >= most_objects) {
      pdos.emplace_back();
      bits = 0;
    }
    pdos.back().push_back(object);
    bits += object.bits;
  }
  return pdos;
}

void countFrames(std::array<double, 9>& frames, const std::vector<CyclicObject>& objects, int most_objects) {
  for (const std::vector<CyclicObject>& pdo : packPdos(objects, most_objects)) {
    int bits = 0;
    for (const CyclicObject& object : pdo)
      bits += object.bits;
    ++frames.at(static_cast<std::size_t>(bits / 8));
  }
}

}  // namespace tandem::hal
