// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/network.h"

#include <algorithm>
#include <stdexcept>

namespace tandem::hal::canopen {
namespace {

// Source of an outgoing frame: a node (NMT), a node + kSdo or kGuard, or one of these.
constexpr std::int16_t kPeriodic = -1;
constexpr std::int16_t kCommand = -2;
constexpr std::int16_t kOwnHeartbeat = -3;
constexpr std::int16_t kSdo = 1000;
constexpr std::int16_t kGuard = 2000;
/// Most frames per receive(), so that a node that floods the bus cannot block the caller.
constexpr std::size_t kMostFrames = 4096;

}  // namespace

Network::Network(can::Bus& bus, const NetworkOptions& options)
    : bus_(bus), options_(options), masters_(options.master_silence) {
  if (options.own_id < 1 || options.own_id > kMaxNodeId)
    throw std::invalid_argument(bus_.name() + ": own node id: found " + std::to_string(options.own_id) +
                                ", expected 1 to 127");
  if (options.sync_overflow == 1 || options.sync_overflow > 240)
    throw std::invalid_argument(bus_.name() + ": overflow of the SYNC counter (1019): found " +
                                std::to_string(options.sync_overflow) + ", expected 0 or 2 to 240");
  if (options.request_interval < 1)
    throw std::invalid_argument(bus_.name() + ": periods between SDO requests: found " +
                                std::to_string(options.request_interval) + ", expected at least 1");
  claim(cob::kNmt, {Use::kMaster, 0, 0, MasterFrame::kNmt});
  claim(cob::kSync, {Use::kMaster, 0, 0, MasterFrame::kSync});
  claim(cob::kHeartbeat + options.own_id, {Use::kMaster, 0, 0, MasterFrame::kHeartbeat});
  outgoing_.resize(commands_.size() + 2);
  origin_.resize(outgoing_.size());
}

void Network::claim(std::uint32_t id, Route route) {
  Route& slot = routes_[id];
  if (slot.use != Use::kForeign)
    throw std::invalid_argument(bus_.name() + ": COB-ID " + std::to_string(id) +
                                " is used twice, expected once; see the node ids and the COB-IDs of PDOs");
  slot = route;
}

int Network::addNode(const NodeSetup& setup) {
  const auto index = static_cast<std::uint8_t>(nodes_.size());
  auto node = std::make_unique<Node>(setup);
  const auto id = static_cast<std::uint32_t>(setup.id);
  claim(cob::kHeartbeat + id, {Use::kHeartbeat, index});
  claim(cob::kEmcy + id, {Use::kEmcy, index});
  claim(cob::kSdoAnswer + id, {Use::kSdo, index});
  claim(cob::kSdoRequest + id, {Use::kMaster, index, 0, MasterFrame::kSdoRequest});
  for (std::size_t k = 0; k < node->tpdos().size(); ++k)
    claim(node->tpdos()[k].id, {Use::kTpdo, index, static_cast<std::uint8_t>(k)});
  for (const Rpdo& pdo : node->rpdos())
    claim(pdo.id, {Use::kMaster, index, 0, MasterFrame::kCommandPdo});
  outgoing_.resize(outgoing_.size() + node->rpdos().size() + 3);
  origin_.resize(outgoing_.size());
  phases_.push_back(NodePhase::kIdle);
  nodes_.push_back(std::move(node));
  return index;
}

void Network::boot(int index, std::int64_t now) noexcept {
  nodes_[index]->boot(now);
  noticePhases(now);
}

void Network::bootAll(std::int64_t now) noexcept {
  for (int k = 0; k < nodeCount(); ++k)
    boot(k, now);
}

void Network::start(int index, std::int64_t now) noexcept {
  nodes_[index]->start(now);
  noticePhases(now);
}

void Network::startAll(std::int64_t now) noexcept {
  for (int k = 0; k < nodeCount(); ++k)
    start(k, now);
}

void Network::command(NmtCommand command, std::uint8_t id) noexcept {
  if (command_count_ < commands_.size())
    commands_[command_count_++] = {command, id};
}

bool Network::all(NodePhase phase) const noexcept {
  return !nodes_.empty() && std::ranges::all_of(nodes_, [&](const auto& node) { return node->phase() == phase; });
}

bool Network::anyFailed() const noexcept {
  return std::ranges::any_of(nodes_, [](const auto& node) { return node->phase() == NodePhase::kFailed; });
}

void Network::setHeartbeat(bool on, NmtState state) noexcept {
  if (on && !heartbeat_)
    next_heartbeat_ = 0;
  heartbeat_ = on;
  heartbeat_state_ = state;
}

std::size_t Network::receive(std::int64_t now) noexcept {
  std::size_t total = 0;
  std::size_t count = incoming_.size();
  while (count == incoming_.size() && total < kMostFrames) {
    count = bus_.receive(incoming_);
    for (std::size_t k = 0; k < count; ++k)
      dispatch(incoming_[k], now);
    total += count;
  }
  for (const auto& node : nodes_)
    node->poll(now);
  noticePhases(now);
  if (bus_.state() != bus_state_) {
    bus_state_ = bus_.state();
    NetworkEvent event;
    event.kind = NetworkEvent::Kind::kBusState;
    event.bus_state = bus_state_;
    event.time = now;
    events_.push(event);
  }
  return total;
}

void Network::dispatch(const CanFrame& frame, std::int64_t now) noexcept {
  ++counters_.received;
  if (frame.error) {
    ++counters_.errors;
    return;
  }
  if (!frame.classicData()) {
    ++counters_.foreign;
    return;
  }
  const Route& route = routes_[frame.id & 0x7FF];
  switch (route.use) {
    case Use::kForeign:
      ++counters_.foreign;
      break;
    case Use::kMaster:
      onMaster(route.master, now);
      break;
    case Use::kTpdo:
      onTpdo(frame, route);
      break;
    case Use::kHeartbeat:
      onHeartbeat(frame, *nodes_[route.node], now);
      break;
    case Use::kEmcy:
      onEmcy(frame, route);
      break;
    case Use::kSdo:
      if (frame.length == 8) {
        ++counters_.sdos;
        nodes_[route.node]->sdo().feed(frame, now);
      } else {
        ++counters_.malformed;
      }
      break;
  }
}

void Network::onTpdo(const CanFrame& frame, const Route& route) noexcept {
  Node& node = *nodes_[route.node];
  Tpdo& pdo = node.tpdos()[route.pdo];
  if (frame.length != pdo.layout.bytes()) {
    ++counters_.malformed;
    ++pdo.bad_length;
  } else if (node.phase() != NodePhase::kOperational && node.phase() != NodePhase::kStarting) {
    ++counters_.early_pdos;
  } else {
    ++counters_.tpdos;
    ++pdo.count;
    pdo.time = frame.time;
    pdo.word = fromBytes(frame.payload());
  }
}

void Network::onHeartbeat(const CanFrame& frame, Node& node, std::int64_t now) noexcept {
  if (frame.length == 1 && node.onState(frame.data[0], now)) {
    ++counters_.heartbeats;
  } else {
    ++counters_.malformed;
  }
}

void Network::onEmcy(const CanFrame& frame, const Route& route) noexcept {
  const auto emcy = parseEmcy(frame);
  if (!emcy) {
    ++counters_.malformed;
    return;
  }
  ++counters_.emcies;
  nodes_[route.node]->onEmcy(*emcy);
  NetworkEvent event;
  event.kind = NetworkEvent::Kind::kEmcy;
  event.node = route.node;
  event.phase = nodes_[route.node]->phase();
  event.emcy = *emcy;
  event.time = frame.time;
  events_.push(event);
}

void Network::onMaster(MasterFrame frame, std::int64_t now) noexcept {
  ++counters_.masters;
  if (!masters_.note(frame, now))
    return;
  NetworkEvent event;
  event.kind = NetworkEvent::Kind::kMaster;
  event.master = frame;
  event.time = now;
  events_.push(event);
}

void Network::noticePhases(std::int64_t now) noexcept {
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (nodes_[k]->phase() == phases_[k])
      continue;
    phases_[k] = nodes_[k]->phase();
    NetworkEvent event;
    event.node = static_cast<int>(k);
    event.phase = phases_[k];
    event.time = now;
    events_.push(event);
  }
}

void Network::queue(const CanFrame& frame, std::int16_t origin) noexcept {
  outgoing_[outgoing_count_] = frame;
  origin_[outgoing_count_++] = origin;
}

void Network::queueNmt() noexcept {
  for (std::size_t k = 0; k < command_count_; ++k)
    queue(nmtFrame(commands_[k].command, commands_[k].id), kCommand);
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    NmtCommand command{};
    if (nodes_[k]->nmtRequest(command))
      queue(nmtFrame(command, nodes_[k]->id()), static_cast<std::int16_t>(k));
  }
}

void Network::queueGuards(std::int64_t now) noexcept {
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (nodes_[k]->guardDue(now))
      queue(guardFrame(nodes_[k]->id()), static_cast<std::int16_t>(k + kGuard));
  }
}

void Network::queueRpdos() noexcept {
  for (const auto& node : nodes_) {
    if (node->phase() != NodePhase::kOperational)
      continue;
    for (Rpdo& pdo : node->rpdos()) {
      if (!pdo.enabled)
        continue;
      CanFrame frame;
      frame.id = pdo.id;
      frame.length = static_cast<std::uint8_t>(pdo.layout.bytes());
      toBytes(pdo.word, {frame.data.data(), frame.length});
      queue(frame, kPeriodic);
      ++pdo.count;
    }
  }
}

void Network::queueRequests(bool few) noexcept {
  bool may = !few || syncs_ >= next_request_sync_;
  const std::size_t first = next_request_;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const std::size_t k = (first + n) % nodes_.size();
    const SdoClient& sdo = nodes_[k]->sdo();
    if (sdo.request() == nullptr || !(may || sdo.urgent()))
      continue;
    queue(*sdo.request(), static_cast<std::int16_t>(k + kSdo));
    if (few && !sdo.urgent()) {
      may = false;
      next_request_ = k + 1;
      next_request_sync_ = syncs_ + static_cast<std::uint64_t>(options_.request_interval);
    }
  }
}

std::size_t Network::transmit(std::int64_t now, const Transmission& what) noexcept {
  outgoing_count_ = 0;
  queueNmt();
  if (heartbeat_ && now >= next_heartbeat_)
    queue(heartbeatFrame(options_.own_id, heartbeat_state_), kOwnHeartbeat);
  if (heartbeat_)
    queueGuards(now);
  if (what.rpdos)
    queueRpdos();
  if (what.sync) {
    ++syncs_;
    if (options_.sync_overflow != 0)
      sync_counter_ = static_cast<std::uint8_t>(sync_counter_ % options_.sync_overflow + 1);
    queue(syncFrame(sync_counter_), kPeriodic);
  }
  queueRequests(what.few_requests);
  const std::size_t taken = outgoing_count_ == 0 ? 0 : bus_.send({outgoing_.data(), outgoing_count_});
  finishSend(taken, now);
  noticePhases(now);
  return taken;
}

void Network::finishSend(std::size_t taken, std::int64_t now) noexcept {
  std::size_t commands = 0;
  for (std::size_t k = 0; k < taken; ++k) {
    const std::int16_t origin = origin_[k];
    if (origin == kCommand) {
      ++commands;
    } else if (origin == kOwnHeartbeat) {
      // On its time grid, but without a burst after a pause.
      next_heartbeat_ += options_.heartbeat_period;
      if (next_heartbeat_ <= now)
        next_heartbeat_ = now + options_.heartbeat_period;
    } else if (origin >= kGuard) {
      nodes_[origin - kGuard]->guardSent(now);
    } else if (origin >= kSdo) {
      nodes_[origin - kSdo]->sdo().sent(now);
    } else if (origin >= 0) {
      nodes_[origin]->nmtSent(now);
    }
  }
  std::copy(commands_.begin() + static_cast<std::ptrdiff_t>(commands),
            commands_.begin() + static_cast<std::ptrdiff_t>(command_count_), commands_.begin());
  command_count_ -= commands;
}

}  // namespace tandem::hal::canopen
