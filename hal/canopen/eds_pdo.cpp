// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/detail/eds_pdo.h"

#include <bit>

namespace tandem::hal::canopen {
namespace {

constexpr std::uint16_t kFirst = 0x1400, kPdos = 0x200;  // PDOs of one direction
constexpr std::uint32_t kOff = 0x8000'0000;              // of a COB-id

EdsObject entry(std::uint16_t index, int sub, const char* name, DataType type, std::int64_t value, std::size_t line) {
  EdsObject object;
  object.address = {index, static_cast<std::uint8_t>(sub)};
  object.name = name;
  object.type = type;
  object.access = Access::kReadWrite;
  object.value = value;
  object.has_value = true;
  object.line = line;
  return object;
}

/// The first four PDOs of each direction have a predefined COB-id; the others have none and are off.
EdsObject cobId(std::uint16_t index, std::size_t line) {
  constexpr int kPredefined = 4;
  const bool receive = index < kFirst + 2 * kPdos;
  const int number = index % kPdos;
  EdsObject object = entry(index, 1, "COB-id", DataType::kUnsigned32, kOff, line);
  if (number < kPredefined) {
    object.value = (receive ? 0x200 : 0x180) + 0x100 * number;
    object.adds_node_id = true;
  }
  return object;
}

std::vector<EdsObject> communication(std::uint16_t index, std::uint32_t mask, std::size_t line) {
  constexpr int kUntilEvent = 255;  // transmission type
  const EdsObject all[] = {cobId(index, line),
                           entry(index, 2, "Transmission type", DataType::kUnsigned8, kUntilEvent, line),
                           entry(index, 3, "Inhibit time", DataType::kUnsigned16, 0, line),
                           entry(index, 4, "Compatibility entry", DataType::kUnsigned8, 0, line),
                           entry(index, 5, "Event timer", DataType::kUnsigned16, 0, line),
                           entry(index, 6, "SYNC start value", DataType::kUnsigned8, 0, line)};
  std::vector<EdsObject> objects{
      entry(index, 0, "Highest sub-index", DataType::kUnsigned8, std::bit_width(mask & 0x3F), line)};
  objects[0].access = Access::kConstant;
  for (const EdsObject& object : all) {
    if ((mask >> (object.address.sub - 1) & 1) != 0)
      objects.push_back(object);
  }
  return objects;
}

}  // namespace

bool isPdoParameter(std::uint16_t index) { return index >= kFirst && index < kFirst + 4 * kPdos; }
bool isPdoMapping(std::uint16_t index) { return isPdoParameter(index) && (index & kPdos) != 0; }

std::vector<EdsObject> pdoParameter(std::uint16_t index, std::uint32_t mask, int entries, std::size_t line) {
  if (!isPdoMapping(index))
    return communication(index, mask, line);
  std::vector<EdsObject> objects{entry(index, 0, "Number of mapped objects", DataType::kUnsigned8, 0, line)};
  objects[0].low = 0;
  objects[0].high = entries;
  for (int sub = 1; sub <= entries; ++sub)
    objects.push_back(entry(index, sub, "Mapped object", DataType::kUnsigned32, 0, line));
  return objects;
}

}  // namespace tandem::hal::canopen
