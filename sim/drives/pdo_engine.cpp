// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/pdo_engine.h"

#include <algorithm>

#include "hal/canopen/cob.h"

namespace tandem::sim::drives {
namespace {

namespace cob = hal::canopen::cob;

constexpr std::uint32_t kAnyIdMask = 0x1FFFFFFF;
constexpr std::uint8_t kEvent = 254;

std::uint16_t communicationIndex(bool receive, int number) noexcept {
  return static_cast<std::uint16_t>((receive ? 0x1400 : 0x1800) + number);
}
std::uint16_t mappingIndex(bool receive, int number) noexcept {
  return static_cast<std::uint16_t>((receive ? 0x1600 : 0x1A00) + number);
}

/// Identifiers that CiA 301 reserves for other services.
bool isRestricted(std::uint32_t id) noexcept {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) || (id >= 0x601 && id <= 0x67F) ||
         id >= 0x6E0;
}

}  // namespace

PdoEngine::PdoEngine(ObjectDictionary& dictionary) : dictionary_(dictionary) { configure(); }

std::int64_t PdoEngine::value(std::uint16_t index, std::uint8_t sub) const noexcept {
  const Entry* entry = dictionary_.find({index, sub});
  return entry == nullptr ? 0 : entry->value;
}

void PdoEngine::load(Pdo& pdo, bool receive, int number) noexcept {
  pdo = {};
  const std::uint16_t communication = communicationIndex(receive, number);
  const std::uint16_t mapping = mappingIndex(receive, number);
  const auto id = static_cast<std::uint32_t>(value(communication, 1));
  pdo.receive = receive;
  pdo.valid = dictionary_.hasIndex(communication) && (id & cob::kInvalid) == 0;
  pdo.id = id & kAnyIdMask;
  pdo.type = static_cast<std::uint8_t>(value(communication, 2));
  pdo.inhibit = value(communication, 3) * 100'000;
  pdo.event = value(communication, 5) * 1'000'000;
  pdo.start = static_cast<std::uint8_t>(value(communication, 6));
  pdo.started = pdo.start == 0;
  const auto count = std::clamp<std::int64_t>(value(mapping, 0), 0, kMostEntries);
  for (std::int64_t k = 1; k <= count; ++k) {
    const auto raw = static_cast<std::uint32_t>(value(mapping, static_cast<std::uint8_t>(k)));
    Entry* entry = dictionary_.find({static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 8)});
    if (entry == nullptr)
      continue;
    pdo.entries[pdo.count++] = entry;
    pdo.bytes += entry->size();
  }
  pdo.valid = pdo.valid && pdo.count > 0 && pdo.bytes <= 8;
}

void PdoEngine::configure() noexcept {
  for (int k = 0; k < kMostPdos; ++k) {
    load(pdos_[k], true, k);
    load(pdos_[kMostPdos + k], false, k);
  }
}

SdoAbort PdoEngine::accept(ObjectAddress object, std::int64_t value) const noexcept {
  if (!isParameter(object.index))
    return SdoAbort::kNone;
  return (object.index & 0x0200) == 0 ? acceptCommunication(object, value) : acceptMapping(object, value);
}

SdoAbort PdoEngine::acceptCommunication(ObjectAddress object, std::int64_t value) const noexcept {
  const auto present = static_cast<std::uint32_t>(this->value(object.index, 1));
  const bool valid = (present & cob::kInvalid) == 0;
  if (object.sub == 1) {
    const auto id = static_cast<std::uint32_t>(value);
    const bool becomes_valid = (id & cob::kInvalid) == 0;
    if ((id & cob::kExtended) != 0 || (becomes_valid && isRestricted(id & kAnyIdMask)) || (id & kAnyIdMask) > 0x7FF)
      return SdoAbort::kValueRange;
    if (valid && becomes_valid && ((id ^ present) & kAnyIdMask) != 0)
      return SdoAbort::kValueRange;
  } else if (object.sub == 2) {
    if (value > 240 && value < kEvent)
      return SdoAbort::kValueRange;
  } else if ((object.sub == 3 || object.sub == 6) && valid) {
    return SdoAbort::kAccess;
  }
  return SdoAbort::kNone;
}

SdoAbort PdoEngine::checkEntry(std::uint32_t raw, bool receive) const noexcept {
  const ObjectAddress address{static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 8)};
  const Entry* entry = dictionary_.visible(address);
  if (entry == nullptr)
    return dictionary_.missing(address);
  const Access access = entry->info.access;
  const bool direction_fits =
      receive ? access == Access::kReadWrite || access == Access::kWriteOnly : access != Access::kWriteOnly;
  if (!entry->info.mappable || !direction_fits || static_cast<int>(raw & 0xFF) != entry->bits())
    return SdoAbort::kNotMappable;
  return SdoAbort::kNone;
}

SdoAbort PdoEngine::acceptMapping(ObjectAddress object, std::int64_t value) const noexcept {
  const bool receive = object.index < 0x1800;
  const auto communication = static_cast<std::uint16_t>(object.index - 0x0200);
  const bool valid = (static_cast<std::uint32_t>(this->value(communication, 1)) & cob::kInvalid) == 0;
  if (valid)
    return SdoAbort::kAccess;
  if (object.sub != 0) {
    if (this->value(object.index, 0) != 0)
      return SdoAbort::kAccess;
    return value == 0 ? SdoAbort::kNone : checkEntry(static_cast<std::uint32_t>(value), receive);
  }
  int bits = 0;
  for (std::int64_t k = 1; k <= value; ++k) {
    const auto raw = static_cast<std::uint32_t>(this->value(object.index, static_cast<std::uint8_t>(k)));
    const SdoAbort code = checkEntry(raw, receive);
    if (code != SdoAbort::kNone)
      return code;
    bits += static_cast<int>(raw & 0xFF);
  }
  return bits > 64 ? SdoAbort::kPdoLength : SdoAbort::kNone;
}

RpdoResult PdoEngine::receive(const CanFrame& frame, std::int64_t now, std::vector<Entry*>& written) noexcept {
  for (Pdo& pdo : pdos_) {
    if (!pdo.receive || !pdo.valid || pdo.id != frame.id)
      continue;
    if (frame.length < pdo.bytes)
      return RpdoResult::kTooShort;
    std::copy_n(frame.data.begin(), 8, pdo.data.begin());
    pdo.last_time = now;
    pdo.seen = true;
    pdo.missed = false;
    if (pdo.synchronous()) {
      pdo.pending = true;
    } else {
      apply(pdo, written);
    }
    return frame.length > pdo.bytes ? RpdoResult::kTooLong : RpdoResult::kTaken;
  }
  return RpdoResult::kNotMine;
}

void PdoEngine::apply(Pdo& pdo, std::vector<Entry*>& written) noexcept {
  std::size_t offset = 0;
  for (int k = 0; k < pdo.count; ++k) {
    Entry& entry = *pdo.entries[k];
    const auto size = static_cast<std::size_t>(entry.size());
    const std::int64_t number = entry.decode(hal::canopen::fromBytes({pdo.data.data() + offset, size}));
    offset += size;
    // A value outside the limits is ignored: a PDO has no reply.
    if ((entry.info.low && number < *entry.info.low) || (entry.info.high && number > *entry.info.high))
      continue;
    entry.value = number;
    written.push_back(&entry);
  }
}

void PdoEngine::syncReceive(std::vector<Entry*>& written) noexcept {
  for (Pdo& pdo : pdos_) {
    if (pdo.receive && pdo.valid && pdo.pending) {
      pdo.pending = false;
      apply(pdo, written);
    }
  }
}

CanFrame PdoEngine::assemble(const Pdo& pdo) const noexcept {
  CanFrame frame;
  frame.id = pdo.id;
  frame.length = static_cast<std::uint8_t>(pdo.bytes);
  std::size_t offset = 0;
  for (int k = 0; k < pdo.count; ++k) {
    const auto size = static_cast<std::size_t>(pdo.entries[k]->size());
    hal::canopen::toBytes(pdo.entries[k]->raw(), {frame.data.data() + offset, size});
    offset += size;
  }
  return frame;
}

void PdoEngine::send(Pdo& pdo, const CanFrame& frame, std::vector<CanFrame>& out) noexcept {
  std::copy_n(frame.data.begin(), 8, pdo.data.begin());
  pdo.seen = true;
  out.push_back(frame);
}

void PdoEngine::syncTransmit(std::uint8_t counter, std::vector<CanFrame>& out) noexcept {
  for (Pdo& pdo : pdos_) {
    if (pdo.receive || !pdo.valid || !pdo.synchronous())
      continue;
    if (!pdo.started) {
      pdo.started = counter == 0 || counter == pdo.start;
      pdo.syncs = pdo.type - 1;  // the SYNC with the start value counts as the first one
      if (!pdo.started)
        continue;
    }
    const CanFrame frame = assemble(pdo);
    if (pdo.type == 0) {
      if (!pdo.seen || !std::equal(frame.data.begin(), frame.data.begin() + 8, pdo.data.begin()))
        send(pdo, frame, out);
    } else if (++pdo.syncs >= pdo.type) {
      pdo.syncs = 0;
      send(pdo, frame, out);
    }
  }
}

void PdoEngine::poll(std::int64_t now, std::vector<CanFrame>& out) noexcept {
  for (Pdo& pdo : pdos_) {
    if (pdo.receive || !pdo.valid || pdo.type < kEvent || (pdo.seen && now - pdo.last_time < pdo.inhibit))
      continue;
    const CanFrame frame = assemble(pdo);
    const bool changed = !pdo.seen || !std::equal(frame.data.begin(), frame.data.begin() + 8, pdo.data.begin());
    const bool due = pdo.event > 0 && now - pdo.last_time >= pdo.event;
    // With a timer and no inhibit time, only the timer triggers: a position changes all the time.
    if (due || (changed && (pdo.event == 0 || pdo.inhibit > 0 || !pdo.seen))) {
      send(pdo, frame, out);
      pdo.last_time = now;
    }
  }
}

int PdoEngine::takeMissedDeadlines(std::int64_t now) noexcept {
  int missed = 0;
  for (Pdo& pdo : pdos_) {
    if (pdo.receive && pdo.valid && pdo.event > 0 && pdo.seen && !pdo.missed && now - pdo.last_time > pdo.event) {
      pdo.missed = true;
      ++missed;
    }
  }
  return missed;
}

double PdoEngine::silence(std::int64_t now) const noexcept {
  std::int64_t last = 0;
  for (const Pdo& pdo : pdos_) {
    if (pdo.receive && pdo.valid && pdo.event > 0 && pdo.seen)
      last = std::max(last, pdo.last_time);
  }
  return last == 0 ? 0.0 : 1e-9 * static_cast<double>(now - last);
}

}  // namespace tandem::sim::drives
