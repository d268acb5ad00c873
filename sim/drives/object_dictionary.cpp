// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/object_dictionary.h"

#include <algorithm>
#include <stdexcept>

namespace tandem::sim::drives {
namespace {

ObjectAddress addressOf(const Entry& entry) noexcept { return entry.info.address; }

/// The object; without a value of its own with that of `other`, if its limits permit it.
EdsObject startsWith(EdsObject object, const EdsObject* other) {
  const bool takes = !object.has_value && other != nullptr && object.value == 0 &&
                     (!object.low || *object.low <= other->value) && (!object.high || other->value <= *object.high);
  if (takes) {
    object.value = other->value;
    object.adds_node_id = other->adds_node_id;
  }
  return object;
}

/// CiA 301: what these objects mean is the manufacturer's choice.
bool ofManufacturer(const EdsObject& object) noexcept {
  return object.address.index >= 0x2000 && object.address.index < 0x6000;
}

bool sameProduct(const Eds& a, const Eds& b) noexcept {
  const auto number = [](const Eds& eds, std::uint8_t sub) {
    const EdsObject* object = eds.find({0x1018, sub});
    return object == nullptr ? 0 : object->value;
  };
  return number(a, 1) == number(b, 1) && number(a, 2) == number(b, 2);
}

}  // namespace

std::int64_t Entry::decode(std::uint64_t raw) const noexcept {
  if (bits() == 0)
    return 0;
  return hal::canopen::isSigned(info.type) ? hal::canopen::signExtend(raw, bits())
                                           : static_cast<std::int64_t>(hal::canopen::lowBits(raw, bits()));
}

ObjectDictionary::ObjectDictionary(const Eds& eds, const Eds& own, std::uint8_t node)
    : node_(node), own_product_(sameProduct(eds, own)) {
  const auto has_meaning = [&](const EdsObject& object) { return own_product_ || !ofManufacturer(object); };
  for (const EdsObject& object : eds.objects)
    entries_.push_back(
        {startsWith(object, has_meaning(object) ? own.find(object.address) : nullptr), 0, object.text, false});
  for (const EdsObject& object : own.objects) {
    if (has_meaning(object) && eds.find(object.address) == nullptr)
      entries_.push_back({object, 0, object.text, true});
  }
  std::ranges::sort(entries_, {}, addressOf);
  reset(0, 0xFFFF);
}

Entry* ObjectDictionary::find(ObjectAddress address) noexcept {
  const auto found = std::ranges::lower_bound(entries_, address, {}, addressOf);
  return found != entries_.end() && found->info.address == address ? &*found : nullptr;
}

const Entry* ObjectDictionary::find(ObjectAddress address) const noexcept {
  return const_cast<ObjectDictionary*>(this)->find(address);
}

const Entry* ObjectDictionary::visible(ObjectAddress address) const noexcept {
  const Entry* entry = find(address);
  return entry == nullptr || entry->hidden ? nullptr : entry;
}

bool ObjectDictionary::hasIndex(std::uint16_t index) const noexcept {
  return std::ranges::any_of(entries_,
                             [&](const Entry& entry) { return entry.info.address.index == index && !entry.hidden; });
}

Entry& ObjectDictionary::require(std::uint16_t index, std::uint8_t sub) {
  Entry* entry = find({index, sub});
  if (entry == nullptr || entry->size() == 0)
    throw std::invalid_argument("the EDS has no numeric default value for object " +
                                describe(ObjectAddress{index, sub}));
  return *entry;
}

void ObjectDictionary::reset(std::uint16_t first, std::uint16_t last) noexcept {
  for (Entry& entry : entries_) {
    if (entry.info.address.index >= first && entry.info.address.index <= last)
      entry.value = entry.info.valueAt(node_);
  }
}

SdoAbort ObjectDictionary::missing(ObjectAddress address) const noexcept {
  return hasIndex(address.index) ? SdoAbort::kNoSubIndex : SdoAbort::kNoObject;
}

SdoAbort ObjectDictionary::checkRead(ObjectAddress address) const noexcept {
  const Entry* entry = visible(address);
  if (entry == nullptr)
    return missing(address);
  return entry->info.access == Access::kWriteOnly ? SdoAbort::kWriteOnly : SdoAbort::kNone;
}

SdoAbort ObjectDictionary::checkWrite(ObjectAddress address, std::span<const std::uint8_t> bytes) const noexcept {
  const Entry* entry = visible(address);
  if (entry == nullptr)
    return missing(address);
  if (entry->info.access == Access::kReadOnly || entry->info.access == Access::kConstant || entry->size() == 0)
    return SdoAbort::kReadOnly;
  const auto size = static_cast<std::size_t>(entry->size());
  if (bytes.size() != size)
    return bytes.size() > size ? SdoAbort::kTooLong : SdoAbort::kTooShort;
  const std::int64_t value = entry->decode(hal::canopen::fromBytes(bytes));
  if (entry->info.high && value > *entry->info.high)
    return SdoAbort::kValueTooHigh;
  if (entry->info.low && value < *entry->info.low)
    return SdoAbort::kValueTooLow;
  return SdoAbort::kNone;
}

}  // namespace tandem::sim::drives
