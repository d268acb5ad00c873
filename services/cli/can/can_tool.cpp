// SPDX-License-Identifier: Apache-2.0
#include <poll.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "hal/can/clock.h"
#include "services/cli/can/can.h"

namespace tandem::cli {

using hal::canopen::NmtState;
using hal::canopen::ObjectAddress;
using hal::canopen::SdoAbort;
using hal::canopen::SdoClient;
using hal::canopen::SdoStatus;

CanTool::CanTool(const CanOptions& options)
    : options_(options), states_(hal::canopen::kMaxNodeId + 1, NmtState::kUnknown) {
  try {
    bus_ = hal::can::openBus(options.bus);
  } catch (const std::exception& error) {
    throw Failure(kUsage, options.bus + ": " + error.what());
  }
}

void CanTool::wait(double seconds) {
  pollfd source{bus_->fd(), POLLIN, 0};
  poll(&source, 1, static_cast<int>(std::ceil(1e3 * seconds)));
}

void CanTool::pump(std::vector<SdoClient>& clients) {
  std::array<hal::can::CanFrame, 64> frames;
  for (std::size_t count = frames.size(); count == frames.size();) {
    count = bus_->receive(frames);
    const std::int64_t now = hal::can::monotonicNow();
    for (std::size_t i = 0; i < count; ++i) {
      const hal::can::CanFrame& frame = frames[i];
      if (frame.classicData() && frame.id == hal::canopen::cob::kSync)
        ++syncs_;
      const std::uint32_t node = frame.id - hal::canopen::cob::kHeartbeat;
      if (frame.classicData() && node >= 1 && node <= hal::canopen::kMaxNodeId && frame.length == 1)
        states_[node] = static_cast<NmtState>(frame.data[0] & 0x7F);
      for (SdoClient& client : clients)
        client.feed(frame, now);
    }
  }
  const std::int64_t now = hal::can::monotonicNow();
  for (SdoClient& client : clients) {
    client.poll(now);
    const hal::can::CanFrame* request = client.request();
    if (request != nullptr && bus_->send({request, 1}) == 1)
      client.sent(now);
  }
}

void CanTool::listen(double seconds) {
  std::vector<SdoClient> none;
  const std::int64_t end = hal::can::monotonicNow() + static_cast<std::int64_t>(1e9 * seconds);
  for (std::int64_t now = hal::can::monotonicNow(); now < end; now = hal::can::monotonicNow()) {
    wait(1e-9 * static_cast<double>(end - now));
    pump(none);
  }
}

void CanTool::refuseBesideMaster() {
  constexpr double kEar = 0.15;  // s, longer than any SYNC period
  listen(kEar);
  if (syncs_ > 0 && !options_.force)
    throw Failure(
        kFailure,
        "received SYNC from another CANopen master, probably tandem-hal; two masters disturb each other's SDO "
        "transfers: stop it, or use --force");
}

void CanTool::readMany(const std::vector<int>& nodes,
                       ObjectAddress object,
                       const std::function<void(int node, const SdoClient&)>& take) {
  std::vector<SdoClient> clients;
  const std::int64_t now = hal::can::monotonicNow();
  for (const int node : nodes) {
    clients.emplace_back(node, static_cast<std::int64_t>(1e9 * options_.timeout));
    clients.back().upload(object, now);
  }
  const auto busy = [](const SdoClient& client) { return client.busy(); };
  while (std::any_of(clients.begin(), clients.end(), busy)) {
    pump(clients);
    wait(1e-3);
  }
  pump(clients);  // sends the aborts of the transfers that timed out
  for (const SdoClient& client : clients) {
    if (client.status() == SdoStatus::kDone)
      take(client.node(), client);
  }
}

void CanTool::run(SdoClient& client) {
  std::vector<SdoClient> one{client};
  while (one[0].busy()) {
    pump(one);
    wait(1e-3);
  }
  pump(one);
  client = one[0];
}

void CanTool::finish(SdoClient& client) {
  run(client);
  if (client.status() != SdoStatus::kDone) {
    throw Failure(kFailure, "node " + std::to_string(client.node()) + ", object " + describe(client.object()) + ": " +
                                describe(client.abort()));
  }
}

std::vector<std::uint8_t> CanTool::read(int node, ObjectAddress object) {
  SdoClient client(node, static_cast<std::int64_t>(1e9 * options_.timeout));
  client.upload(object, hal::can::monotonicNow());
  finish(client);
  return {client.data().begin(), client.data().end()};
}

SdoAbort CanTool::tryRead(int node, ObjectAddress object, std::vector<std::uint8_t>& data) {
  SdoClient client(node, static_cast<std::int64_t>(1e9 * options_.timeout));
  client.upload(object, hal::can::monotonicNow());
  run(client);
  if (client.status() != SdoStatus::kDone && client.abort() == SdoAbort::kTimeout)
    throw Failure(kFailure, "node " + std::to_string(node) + " does not answer (object " + describe(object) + ")");
  data.assign(client.data().begin(), client.data().end());
  return client.status() == SdoStatus::kDone ? SdoAbort::kNone : client.abort();
}

void CanTool::write(int node, ObjectAddress object, std::span<const std::uint8_t> data) {
  SdoClient client(node, static_cast<std::int64_t>(1e9 * options_.timeout));
  if (!client.download(object, data, hal::can::monotonicNow()))
    throw Failure(kUsage, "the value is too long");
  finish(client);
}

ObjectAddress parseObject(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto number = [&](const std::string& part, unsigned most) {
    unsigned value = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value, 16);
    if (part.empty() || error != std::errc{} || end != part.data() + part.size() || value > most)
      throw Failure(kUsage, "object: found '" + text + "', expected INDEX or INDEX:SUB, hexadecimal, e.g. 607D:1");
    return value;
  };
  ObjectAddress object;
  object.index = static_cast<std::uint16_t>(number(text.substr(0, colon), 0xFFFF));
  if (colon != std::string::npos)
    object.sub = static_cast<std::uint8_t>(number(text.substr(colon + 1), 0xFF));
  return object;
}

int parseNode(const std::string& text) {
  int node = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), node);
  if (error != std::errc{} || end != text.data() + text.size() || node < 1 || node > hal::canopen::kMaxNodeId)
    throw Failure(kUsage, "node: found '" + text + "', expected 1 to 127");
  return node;
}

}  // namespace tandem::cli
