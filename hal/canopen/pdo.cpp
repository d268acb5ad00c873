// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/pdo.h"

#include <stdexcept>

#include "hal/canopen/cob.h"

namespace tandem::hal::canopen {
namespace {

constexpr int kMaxNumber = 512;

std::uint16_t communicationIndex(int number, PdoDirection direction) {
  return static_cast<std::uint16_t>((direction == PdoDirection::kReceive ? 0x1400 : 0x1800) + number - 1);
}

std::uint16_t mappingIndex(int number, PdoDirection direction) {
  return static_cast<std::uint16_t>((direction == PdoDirection::kReceive ? 0x1600 : 0x1A00) + number - 1);
}

std::string nameOf(int number, PdoDirection direction) {
  return (direction == PdoDirection::kReceive ? "RPDO " : "TPDO ") + std::to_string(number);
}

void requireNumber(int number, PdoDirection direction) {
  if (number < 1 || number > kMaxNumber)
    throw std::invalid_argument(nameOf(number, direction) + ": found " + std::to_string(number) +
                                " as its number, expected 1 to 512");
}

/// A step that writes 0 is optional: the node may lack the object.
SetupStep unlessAbsent(SetupStep step) {
  step.optional = step.value == 0;
  return step;
}

}  // namespace

int PdoLayout::add(const PdoEntry& entry) noexcept {
  if (size_ == kMaxEntries || entry.bits < 1 || bits_ + entry.bits > 64)
    return -1;
  entries_[size_] = entry;
  offset_[size_] = static_cast<std::uint8_t>(bits_);
  bits_ += entry.bits;
  return size_++;
}

std::uint32_t cobIdOf(const PdoConfig& pdo, PdoDirection direction, int node) {
  requireNumber(pdo.number, direction);
  if (pdo.id > 0x7FF)
    throw std::invalid_argument(nameOf(pdo.number, direction) + ": COB-ID: found " + std::to_string(pdo.id) +
                                ", expected at most 2047 (11 bits)");
  if (pdo.id != 0)
    return pdo.id;
  if (pdo.number > 4)
    throw std::invalid_argument(nameOf(pdo.number, direction) +
                                ": found no COB-ID, expected one: CiA 301 defines those of PDO 1 to 4 only");
  return direction == PdoDirection::kReceive ? cob::rpdo(pdo.number, node) : cob::tpdo(pdo.number, node);
}

std::vector<SetupStep> pdoOffSteps(int number, PdoDirection direction, int node) {
  requireNumber(number, direction);
  PdoConfig pdo;
  pdo.number = number;
  const std::uint32_t id = number <= 4 ? cobIdOf(pdo, direction, node) : 0;
  return {writeOnly({communicationIndex(number, direction), 1}, std::int64_t{cob::kInvalid | id}, 4,
                    nameOf(number, direction) + " off")};
}

std::vector<SetupStep> pdoSteps(const PdoConfig& pdo, PdoDirection direction, int node) {
  const std::uint32_t id = cobIdOf(pdo, direction, node);
  const std::string name = nameOf(pdo.number, direction);
  if (pdo.layout.size() == 0)
    throw std::invalid_argument(name + ": found no mapped object, expected at least one");
  const std::uint16_t communication = communicationIndex(pdo.number, direction);
  const std::uint16_t mapping = mappingIndex(pdo.number, direction);
  const bool transmit = direction == PdoDirection::kTransmit;
  const std::uint32_t cob_id = id | (transmit ? cob::kNoRemote : 0u);

  std::vector<SetupStep> steps;
  const auto put = [&](std::uint16_t index, int sub, std::int64_t value, int size, const std::string& what) {
    steps.push_back(writeOnly({index, static_cast<std::uint8_t>(sub)}, value, size, name + " " + what));
  };
  put(communication, 1, std::int64_t{cob::kInvalid | cob_id}, 4, "off");
  put(mapping, 0, 0, 1, "without objects");
  for (int k = 0; k < pdo.layout.size(); ++k)
    put(mapping, k + 1, pdo.layout[k].raw(), 4, "object " + std::to_string(k + 1));
  put(mapping, 0, pdo.layout.size(), 1, "number of objects");
  put(communication, 2, pdo.transmission_type, 1, "transmission type");
  if (transmit)
    steps.push_back(unlessAbsent(writeOnly({communication, 3}, pdo.inhibit_time, 2, name + " inhibit time")));
  steps.push_back(unlessAbsent(writeOnly({communication, 5}, pdo.event_timer, 2, name + " event timer")));
  steps.back().protections = pdo.protections;
  put(communication, 1, cob_id, 4, "on");

  std::vector<SetupStep> read_back;
  for (std::size_t k = 1; k < steps.size(); ++k) {
    SetupStep verify = steps[k];
    if (verify.object == ObjectAddress{mapping, 0} && verify.value == 0)
      continue;
    verify.kind = SetupStep::Kind::kCheck;
    // The node decides whether it answers remote frames.
    if (verify.object == ObjectAddress{communication, 1})
      verify.mask = ~std::uint64_t{cob::kNoRemote};
    read_back.push_back(verify);
  }
  steps.insert(steps.end(), read_back.begin(), read_back.end());
  return steps;
}

}  // namespace tandem::hal::canopen
