// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/drive_bus.h"

#include <linux/can/error.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tandem::sim::drives {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kMostCatchUp = kSecond;  // longest simulated time per poll, after a pause of the process
constexpr std::size_t kMostFrames = 4096;       // most frames per poll
constexpr std::size_t kQueue = 1024;

double valueOf(const Injection& injection) noexcept {
  if (injection.value != 0.0)
    return injection.value;
  switch (injection.kind) {
    case FaultKind::kWrong:
      return 5000.0;
    case FaultKind::kSlow:
      return 0.2;
    case FaultKind::kDelayed:
      return 20.0;
    case FaultKind::kIntermittent:
      return 200.0;
    case FaultKind::kFrameLoss:
    case FaultKind::kByteFlips:
      return 0.1;
    case FaultKind::kBabbling:
      return 2000.0;
    case FaultKind::kOverload:
      return 900.0;
    default:
      return 1.0;
  }
}

std::int64_t milliseconds(double value) noexcept { return static_cast<std::int64_t>(value * 1e6); }

}  // namespace

/** A device, with the faults between it and the bus. */
struct DriveBus::Node {
  Device* device = nullptr;
  Drive* drive = nullptr;  // one of these two
  Encoder* encoder = nullptr;
  bool muted = false;      // temporarily off the bus
  std::int64_t delay = 0;  // ns
  std::int64_t blink = 0;  // half period of an intermittent fault, ns; 0: none
  std::int64_t blink_start = 0;
  double loss = 0.0;
  double flips = 0.0;
  double babble = 0.0;           // frames/s
  std::int64_t babble_time = 0;  // time up to which its frames are sent, ns
};

DriveBus::DriveBus(hal::can::Bus& bus, const BusSpec& spec, std::int64_t now)
    : bus_(bus), random_(spec.seed), time_(now) {
  std::array<bool, 128> used{};
  const auto add = [&](Device& device, Drive* drive, Encoder* encoder) {
    if (used[device.id()])
      throw std::invalid_argument("node id " + std::to_string(device.id()) + " is used twice");
    used[device.id()] = true;
    Node node;
    node.device = &device;
    node.drive = drive;
    node.encoder = encoder;
    nodes_.push_back(node);
  };
  for (const DriveSpec& one : spec.drives) {
    const auto own = spec.drive_eds_of.find(one.id);
    drives_.push_back(std::make_unique<Drive>(one, own == spec.drive_eds_of.end() ? spec.drive_eds : own->second));
    add(*drives_.back(), drives_.back().get(), nullptr);
  }
  for (const EncoderSpec& one : spec.encoders) {
    const auto drive = std::ranges::find_if(drives_, [&](const auto& d) { return d->id() == one.drive; });
    if (drive == drives_.end()) {
      throw std::invalid_argument("encoder " + std::to_string(one.id) + " sits on drive " + std::to_string(one.drive) +
                                  ", which is not there");
    }
    encoders_.push_back(std::make_unique<Encoder>(one, spec.encoder_eds, (*drive)->motor()));
    add(*encoders_.back(), nullptr, encoders_.back().get());
  }
  active_.reserve(64);
  delayed_.reserve(kQueue);
  outgoing_.reserve(kQueue);
  for (Node& node : nodes_)
    node.device->powerOn(now);
}

DriveBus::~DriveBus() = default;

DriveBus::Node* DriveBus::nodeOf(std::uint8_t id) noexcept {
  const auto found = std::ranges::find_if(nodes_, [&](const Node& node) { return node.device->id() == id; });
  return found == nodes_.end() ? nullptr : &*found;
}

bool DriveBus::possible(const Injection& injection) noexcept {
  if (injection.kind == FaultKind::kBusOff)
    return injection.node == 0;
  if (injection.node == 0)
    return injection.kind == FaultKind::kFrameLoss || injection.kind == FaultKind::kOff ||
           injection.kind == FaultKind::kEmergencyStop;
  const Node* node = nodeOf(injection.node);
  if (node == nullptr)
    return false;
  const bool drive_only = injection.kind == FaultKind::kSlow || injection.kind == FaultKind::kOverCurrent ||
                          injection.kind == FaultKind::kOverTemperature || injection.kind == FaultKind::kRunaway ||
                          injection.kind == FaultKind::kBrakeFailure || injection.kind == FaultKind::kEmergencyStop ||
                          injection.kind == FaultKind::kOverload;
  return node->drive != nullptr || !drive_only;
}

bool DriveBus::inject(const Injection& injection) noexcept {
  if (!possible(injection) || active_.size() == active_.capacity())
    return false;
  clear(injection.node, injection.kind);
  const auto end = injection.duration > 0.0 ? time_ + static_cast<std::int64_t>(injection.duration * 1e9) : 0;
  active_.push_back({injection, time_, end});
  apply(injection, true);
  return true;
}

int DriveBus::clear(std::uint8_t node, std::optional<FaultKind> kind) noexcept {
  int cleared = 0;
  for (std::size_t k = active_.size(); k-- > 0;) {
    const Injection injection = active_[k].injection;
    // Node 0 selects the faults of all nodes and of the bus.
    if ((node != 0 && injection.node != node) || (kind && injection.kind != *kind))
      continue;
    active_.erase(active_.begin() + static_cast<std::ptrdiff_t>(k));
    apply(injection, false);
    ++cleared;
  }
  return cleared;
}

bool DriveBus::has(std::uint8_t node, FaultKind kind) const noexcept {
  return std::ranges::any_of(
      active_, [&](const Active& active) { return active.injection.kind == kind && active.injection.node == node; });
}

void DriveBus::mark() noexcept {
  for (const auto& drive : drives_)
    drive->mark();
}

void DriveBus::apply(const Injection& injection, bool on) noexcept {
  if (injection.kind == FaultKind::kBusOff) {
    // The error frame first: a bus that is off sends nothing after it.
    sendError(on ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED);
    off_ = on;
    return;
  }
  for (Node& node : nodes_) {
    if (injection.node == 0 || node.device->id() == injection.node)
      applyTo(node, injection, on);
  }
}

void DriveBus::applyTo(Node& node, const Injection& injection, bool on) noexcept {
  const double value = valueOf(injection);
  SensorFaults& sensor = node.drive != nullptr ? node.drive->sensor : node.encoder->sensor;
  MotorFaults unused;
  MotorFaults& motor = node.drive != nullptr ? node.drive->motor().faults : unused;
  switch (injection.kind) {
    case FaultKind::kOff:
      on ? node.device->powerOff() : node.device->powerOn(time_);
      break;
    case FaultKind::kStuck:
      (node.drive != nullptr ? motor.blocked : sensor.frozen) = on;
      break;
    case FaultKind::kGarbage:
      sensor.garbage = on;
      break;
    case FaultKind::kWrong:
      sensor.offset = on ? value : 0.0;
      break;
    case FaultKind::kSlow:
      motor.speed = on ? value : 1.0;
      break;
    case FaultKind::kDelayed:
      node.delay = on ? milliseconds(value) : 0;
      break;
    case FaultKind::kIntermittent:
      node.blink = on ? std::max<std::int64_t>(milliseconds(value), 1) : 0;
      node.blink_start = time_;
      node.muted = on;
      break;
    case FaultKind::kOverCurrent:
      motor.over_current = on;
      break;
    case FaultKind::kOverTemperature:
      motor.over_heated = on;
      break;
    case FaultKind::kEncoderAlarm:
      sensor.alarm = on;
      break;
    case FaultKind::kFrameLoss:
      node.loss = on ? value : 0.0;
      break;
    case FaultKind::kByteFlips:
      node.flips = on ? value : 0.0;
      break;
    case FaultKind::kBabbling:
      node.babble = on ? value : 0.0;
      node.babble_time = time_;
      break;
    case FaultKind::kRunaway:
      motor.runaway = on ? value : 0.0;
      break;
    case FaultKind::kBrakeFailure:
      motor.no_brake = on;
      break;
    case FaultKind::kOverload:
      motor.load = on ? value : 0.0;
      break;
    case FaultKind::kEmergencyStop:
      if (node.drive != nullptr)
        node.drive->emergency_stop = on;
      break;
    case FaultKind::kBusOff:
      break;
  }
}

void DriveBus::sendError(std::uint32_t error_class) noexcept {
  CanFrame frame;
  frame.error = true;
  frame.id = error_class;
  frame.length = 8;
  const std::size_t sent = bus_.send({&frame, 1});
  record_.sent += sent;
  record_.unsent += 1 - sent;
}

void DriveBus::poll(std::int64_t now) noexcept {
  time_ = std::max(time_, now - kMostCatchUp);
  receive(now);
  advance(now);
  for (Node& node : nodes_)
    collect(node, now);
  release(now);
  babble(now);
  flush();
}

void DriveBus::advance(std::int64_t now) noexcept {
  while (time_ + kStep <= now) {
    time_ += kStep;
    expire(time_);
    applyIntermittentFault(time_);
    for (Node& node : nodes_) {
      node.device->advance(time_, 1e-9 * static_cast<double>(kStep));
      if (!node.device->out().empty())
        collect(node, time_);
    }
  }
}

void DriveBus::expire(std::int64_t now) noexcept {
  for (std::size_t k = active_.size(); k-- > 0;) {
    const Active active = active_[k];
    if (active.end == 0 || now < active.end)
      continue;
    active_.erase(active_.begin() + static_cast<std::ptrdiff_t>(k));
    apply(active.injection, false);
  }
}

void DriveBus::applyIntermittentFault(std::int64_t now) noexcept {
  for (Node& node : nodes_) {
    if (node.blink > 0)
      node.muted = (now - node.blink_start) / node.blink % 2 == 0;
  }
}

bool DriveBus::loses(const Node& node) noexcept {
  if (node.muted)
    return true;
  return node.loss > 0.0 && std::uniform_real_distribution<double>()(random_) < node.loss;
}

void DriveBus::receive(std::int64_t now) noexcept {
  std::size_t count = incoming_.size();
  for (std::size_t total = 0; count == incoming_.size() && total < kMostFrames; total += count) {
    count = bus_.receive(incoming_);
    record_.received += count;
    if (off_)
      continue;
    for (std::size_t k = 0; k < count; ++k) {
      if (incoming_[k].error)
        continue;
      // Drives receive a frame at its arrival time, even if this process is late: first advance to that time.
      const std::int64_t came =
          incoming_[k].time == 0 ? now : std::clamp(incoming_[k].time, time_, std::max(time_, now));
      advance(came);
      for (Node& node : nodes_) {
        if (loses(node)) {
          ++record_.lost;
          continue;
        }
        node.device->receive(incoming_[k], came);
      }
    }
  }
}

void DriveBus::collect(Node& node, std::int64_t now) noexcept {
  for (CanFrame& frame : node.device->out()) {
    if (off_ || loses(node)) {
      ++record_.lost;
      continue;
    }
    if (node.flips > 0.0 && frame.length > 0 && std::uniform_real_distribution<double>()(random_) < node.flips) {
      const auto bit = std::uniform_int_distribution<int>(0, 8 * frame.length - 1)(random_);
      frame.data[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::uint8_t>(1 << bit % 8);
      ++record_.flipped;
    }
    if (node.delay > 0) {
      if (delayed_.size() < delayed_.capacity()) {
        delayed_.push_back({frame, now + node.delay});
      } else {
        ++record_.dropped;
      }
    } else if (outgoing_.size() < outgoing_.capacity()) {
      outgoing_.push_back(frame);
    } else {
      ++record_.dropped;
    }
  }
  node.device->out().clear();
}

void DriveBus::release(std::int64_t now) noexcept {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < delayed_.size(); ++k) {
    if (delayed_[k].due <= now && outgoing_.size() < outgoing_.capacity()) {
      outgoing_.push_back(delayed_[k].frame);
    } else {
      delayed_[kept++] = delayed_[k];
    }
  }
  delayed_.resize(kept);
}

void DriveBus::babble(std::int64_t now) noexcept {
  for (Node& node : nodes_) {
    if (node.babble <= 0.0 || off_)
      continue;
    const double since = 1e-9 * static_cast<double>(now - node.babble_time);
    const auto frames = std::min<std::size_t>(static_cast<std::size_t>(std::max(0.0, node.babble * since)), 256);
    node.babble_time += static_cast<std::int64_t>(1e9 * static_cast<double>(frames) / node.babble);
    for (std::size_t k = 0; k < frames && outgoing_.size() < outgoing_.capacity(); ++k) {
      CanFrame frame;
      frame.id = 1;  // highest priority after NMT; no function
      frame.length = 8;
      outgoing_.push_back(frame);
      ++record_.babble_frames;
    }
  }
}

void DriveBus::flush() noexcept {
  if (outgoing_.empty())
    return;
  const std::size_t sent = bus_.send(outgoing_);
  record_.sent += sent;
  record_.unsent += outgoing_.size() - sent;
  outgoing_.erase(outgoing_.begin(), outgoing_.begin() + static_cast<std::ptrdiff_t>(sent));
}

}  // namespace tandem::sim::drives
