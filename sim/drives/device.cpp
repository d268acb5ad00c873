// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/device.h"

#include <algorithm>
#include <stdexcept>

namespace tandem::sim::drives {
namespace {

namespace cob = hal::canopen::cob;
namespace error_code = hal::canopen::error_code;

constexpr std::uint32_t kIdMask = 0x7FF;

/// Speeds and accelerations of CiA 402.
bool isRate(std::uint16_t index) noexcept {
  return (index >= 0x607F && index <= 0x6085) || index == 0x6099 || index == 0x609A;
}

}  // namespace

Device::Device(std::uint8_t id, const Eds& eds, const Eds& own, std::uint32_t serial)
    : id_(id),
      dictionary_(eds, own, id),
      sdo_(id, *this),
      pdos_(dictionary_),
      error_register_(dictionary_.require(0x1001)),
      heartbeat_(dictionary_.require(0x1017)),
      sync_id_(dictionary_.require(0x1005)),
      emcy_id_(dictionary_.require(0x1014)),
      error_behaviour_(dictionary_.require(0x1029, 1)) {
  if (id < 1 || id > hal::canopen::kMaxNodeId)
    throw std::invalid_argument("node id " + std::to_string(id) + ", expected 1 to 127");
  Entry& number = dictionary_.require(0x1018, 4);
  number.info.value = serial;
  number.value = serial;
  out_.reserve(64);
  written_.reserve(64);
}

void Device::powerOn(std::int64_t now) noexcept {
  if (powered_)
    return;
  powered_ = true;
  now_ = now;
  boot(true);
}

void Device::powerOff() noexcept {
  powered_ = false;
  nmt_ = NmtState::kBootUp;
  out_.clear();
  resetApplication();
}

void Device::boot(bool application) noexcept {
  if (nmt_ == NmtState::kOperational && !application)
    contactLost();
  if (application) {
    resetApplication();
    dictionary_.reset(0x1000, 0xFFFF);
    last_error_ = 0;
  } else {
    // Communication errors end with the communication reset; the other bits of 1001 stay.
    constexpr auto kBoth =
        static_cast<std::uint8_t>(ErrorBit::kCommunication) | static_cast<std::uint8_t>(ErrorBit::kGeneric);
    const std::int64_t errors = error_register_.value;
    dictionary_.reset(0x1000, 0x1FFF);
    error_register_.value = (errors & ~kBoth) == 0 ? 0 : errors & ~static_cast<std::uint8_t>(ErrorBit::kCommunication);
  }
  sdo_.reset();
  life_guard_.restart();
  answer_at_ = 0;
  pdos_.configure();
  loadProducers();
  nmt_ = NmtState::kBootUp;
  boot_at_ = now_ + kBootTime;
}

void Device::send(const CanFrame& frame) noexcept {
  // A bounded queue, like that of a controller.
  if (out_.size() < out_.capacity()) {
    ++counters_.frames_out;
    out_.push_back(frame);
  }
}

void Device::setHabits(const Habits& habits) noexcept {
  habits_ = habits;
  sdo_.form = habits.answers;
}

void Device::reply(const CanFrame& answer) noexcept {
  if (habits_.answer_delay == 0)
    return send(answer);
  held_answer_ = answer;
  answer_at_ = now_ + habits_.answer_delay;
}

void Device::enter(NmtState state) noexcept {
  if (state == nmt_)
    return;
  const bool left = nmt_ == NmtState::kOperational;
  nmt_ = state;
  pdos_.configure();
  if (left)
    contactLost();
}

void Device::receive(const CanFrame& frame, std::int64_t now) noexcept {
  if (!powered_ || nmt_ == NmtState::kBootUp)
    return;
  now_ = now;
  if (frame.remote && !frame.extended && frame.id == cob::kHeartbeat + id_)
    return onGuard();
  if (!frame.classicData())
    return;
  ++counters_.frames_in;
  if (frame.id == cob::kNmt) {
    onNmt(frame);
  } else if (frame.id == (static_cast<std::uint32_t>(sync_id_.value) & kIdMask)) {
    onSync(frame);
  } else if (frame.id > cob::kHeartbeat && frame.id <= cob::kHeartbeat + hal::canopen::kMaxNodeId) {
    onHeartbeat(frame);
  } else if (frame.id == cob::kSdoRequest + id_ && nmt_ != NmtState::kStopped) {
    ++counters_.sdo_requests;
    refresh();
    CanFrame answer;
    if (sdo_.handle(frame, now, answer))
      reply(answer);
  } else if (nmt_ == NmtState::kOperational) {
    onRpdo(frame);
  } else {
    --counters_.frames_in;
  }
}

void Device::onNmt(const CanFrame& frame) noexcept {
  if (frame.length != 2 || (frame.data[1] != 0 && frame.data[1] != id_))
    return;
  using hal::canopen::NmtCommand;
  switch (static_cast<NmtCommand>(frame.data[0])) {
    case NmtCommand::kStart:
      enter(NmtState::kOperational);
      break;
    case NmtCommand::kStop:
      enter(NmtState::kStopped);
      break;
    case NmtCommand::kPreOperational:
      enter(NmtState::kPreOperational);
      break;
    case NmtCommand::kResetNode:
      boot(true);
      break;
    case NmtCommand::kResetCommunication:
      boot(false);
      break;
  }
}

void Device::onSync(const CanFrame& frame) noexcept {
  if (nmt_ != NmtState::kOperational)
    return;
  // With the counter (1019) a SYNC has one byte, without it none.
  const Entry* counter = dictionary_.visible({0x1019, 0});
  if (frame.length != (counter != nullptr && counter->value != 0 ? 1 : 0)) {
    raise(error_code::kSyncLength, ErrorBit::kCommunication);
    return;
  }
  ++counters_.syncs;
  written_.clear();
  pdos_.syncReceive(written_);
  notifyWritten();
  synchronized();
  refresh();
  const std::size_t before = out_.size();
  pdos_.syncTransmit(frame.length == 1 ? frame.data[0] : 0, out_);
  counters_.frames_out += out_.size() - before;
}

void Device::onHeartbeat(const CanFrame& frame) noexcept {
  const auto node = static_cast<std::uint8_t>(frame.id - cob::kHeartbeat);
  for (Producer& producer : producers_) {
    if (producer.timeout > 0 && producer.node == node && frame.length == 1) {
      producer.last = now_;
      producer.active = true;
    }
  }
}

std::int64_t Device::lifeTime() const noexcept {
  const Entry *time = dictionary_.visible({0x100C, 0}), *factor = dictionary_.visible({0x100D, 0});
  return time == nullptr || factor == nullptr ? 0 : time->value * factor->value * 1'000'000;
}

/// A device has a heartbeat or node guarding, not both (CiA 301).
void Device::onGuard() noexcept {
  if (dictionary_.visible({0x100C, 0}) == nullptr || heartbeat_.value > 0)
    return;
  ++counters_.frames_in;
  CanFrame answer = hal::canopen::heartbeatFrame(id_, nmt_);
  answer.data[0] = life_guard_.answer(answer.data[0], now_);
  send(answer);
}

void Device::onRpdo(const CanFrame& frame) noexcept {
  written_.clear();
  switch (pdos_.receive(frame, now_, written_)) {
    case RpdoResult::kNotMine:
      --counters_.frames_in;
      return;
    case RpdoResult::kTooShort:
      ++counters_.bad_rpdos;
      raise(error_code::kPdoLength, ErrorBit::kCommunication);
      return;
    case RpdoResult::kTooLong:
      ++counters_.bad_rpdos;
      raise(error_code::kPdoLengthExceeded, ErrorBit::kCommunication);
      break;
    case RpdoResult::kTaken:
      break;
  }
  ++counters_.rpdos;
  notifyWritten();
}

void Device::notifyWritten() noexcept {
  for (const Entry* entry : written_)
    written(*entry);
}

void Device::advance(std::int64_t now, double dt) noexcept {
  now_ = now;
  step(dt);
  if (!powered_)
    return;
  if (nmt_ == NmtState::kBootUp) {
    if (now < boot_at_)
      return;
    ++counters_.boots;
    nmt_ = NmtState::kPreOperational;
    send(hal::canopen::heartbeatFrame(id_, NmtState::kBootUp));
    next_heartbeat_ = now;
    return;
  }
  watchMaster();
  if (heartbeat_.value > 0 && now >= next_heartbeat_) {
    next_heartbeat_ = std::max(next_heartbeat_ + heartbeat_.value * 1'000'000, now);
    send(hal::canopen::heartbeatFrame(id_, nmt_));
  }
  if (answer_at_ != 0 && now >= answer_at_) {
    send(held_answer_);
    answer_at_ = 0;
  }
  CanFrame answer;
  if (sdo_.poll(now, answer))
    send(answer);
  if (nmt_ == NmtState::kOperational) {
    refresh();
    const std::size_t before = out_.size();
    pdos_.poll(now, out_);
    counters_.frames_out += out_.size() - before;
  }
}

void Device::watchMaster() noexcept {
  for (Producer& producer : producers_) {
    if (producer.active && now_ - producer.last > producer.timeout) {
      producer.active = false;
      ++counters_.heartbeats_lost;
      communicationError(error_code::kHeartbeat);
    }
  }
  if (life_guard_.lost(lifeTime(), now_)) {
    ++counters_.heartbeats_lost;
    communicationError(error_code::kHeartbeat);
  }
  if (nmt_ == NmtState::kOperational && pdos_.takeMissedDeadlines(now_) > 0) {
    ++counters_.rpdo_timeouts;
    raise(error_code::kRpdoTimeout, ErrorBit::kCommunication);
    contactLost();
  }
}

void Device::communicationError(std::uint16_t code) noexcept {
  raise(code, ErrorBit::kCommunication);
  const std::int64_t behaviour = error_behaviour_.value;
  if (behaviour == 0 && nmt_ == NmtState::kOperational) {
    enter(NmtState::kPreOperational);
  } else if (behaviour == 2) {
    const bool operational = nmt_ == NmtState::kOperational;
    enter(NmtState::kStopped);
    if (!operational)
      contactLost();
  } else {
    contactLost();
  }
}

void Device::raise(std::uint16_t code, ErrorBit bit, std::uint8_t detail) noexcept {
  ++counters_.emergencies;
  last_error_ = code;
  error_register_.value |= static_cast<std::uint8_t>(bit) | static_cast<std::uint8_t>(ErrorBit::kGeneric);
  if (Entry* count = dictionary_.find({0x1003, 0})) {
    for (std::uint8_t k = 8; k > 1; --k) {
      Entry* older = dictionary_.find({0x1003, k});
      const Entry* newer = dictionary_.find({0x1003, static_cast<std::uint8_t>(k - 1)});
      if (older != nullptr && newer != nullptr)
        older->value = newer->value;
    }
    if (Entry* newest = dictionary_.find({0x1003, 1}))
      newest->value = code;
    count->value = std::min<std::int64_t>(count->value + 1, 8);
  }
  if (powered_ && nmt_ != NmtState::kStopped && nmt_ != NmtState::kBootUp) {
    send(hal::canopen::emcyFrame(static_cast<std::uint32_t>(emcy_id_.value) & kIdMask,
                                 {code, static_cast<std::uint8_t>(error_register_.value), {detail}}));
  }
}

void Device::clear(ErrorBit bit) noexcept {
  if (error_register_.value == 0)
    return;
  error_register_.value &= ~std::int64_t{static_cast<std::uint8_t>(bit)};
  if (error_register_.value > static_cast<std::uint8_t>(ErrorBit::kGeneric))
    return;
  error_register_.value = 0;
  last_error_ = 0;
  if (powered_ && nmt_ != NmtState::kStopped && nmt_ != NmtState::kBootUp)
    send(hal::canopen::emcyFrame(static_cast<std::uint32_t>(emcy_id_.value) & kIdMask, {}));
}

void Device::loadProducers() noexcept {
  for (std::size_t k = 0; k < producers_.size(); ++k) {
    const Entry* entry = dictionary_.find({0x1016, static_cast<std::uint8_t>(k + 1)});
    const auto raw = entry == nullptr ? 0u : static_cast<std::uint32_t>(entry->value);
    producers_[k] = {static_cast<std::uint8_t>(raw >> 16), std::int64_t{raw & 0xFFFF} * 1'000'000, 0, false};
  }
}

SdoAbort Device::readObject(ObjectAddress object, std::span<std::uint8_t> bytes, std::size_t& size) {
  const SdoAbort code = dictionary_.checkRead(object);
  if (code != SdoAbort::kNone)
    return code;
  const Entry& entry = *dictionary_.find(object);
  if (entry.size() == 0) {
    size = std::min(bytes.size(), entry.text.size());
    std::copy_n(entry.text.begin(), size, bytes.begin());
  } else {
    size = static_cast<std::size_t>(entry.size());
    hal::canopen::toBytes(entry.raw(), bytes.first(size));
  }
  return SdoAbort::kNone;
}

SdoAbort Device::writeObject(ObjectAddress object, std::span<const std::uint8_t> bytes) {
  SdoAbort code = dictionary_.checkWrite(object, bytes);
  if (code != SdoAbort::kNone)
    return code;
  Entry& entry = *dictionary_.find(object);
  const std::int64_t value = entry.decode(hal::canopen::fromBytes(bytes));
  code = pdos_.accept(object, value);
  if (code == SdoAbort::kNone)
    code = accept(entry, value);
  if (code != SdoAbort::kNone)
    return code;
  entry.value = isRate(object.index) ? value - value % habits_.rounding : value;
  if (PdoEngine::isParameter(object.index))
    pdos_.configure();
  if (object.index == 0x1016)
    loadProducers();
  if (&entry == &heartbeat_)
    next_heartbeat_ = now_;
  written(entry);
  return SdoAbort::kNone;
}

}  // namespace tandem::sim::drives
