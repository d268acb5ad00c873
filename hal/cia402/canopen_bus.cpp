// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/canopen_bus.h"

#include <cmath>

#include "hal/nanoseconds.h"

namespace tandem::hal {
namespace {

canopen::NetworkOptions networkOptions(const HardwareConfig& config, int b, double heartbeat_budget) {
  canopen::NetworkOptions options;
  const BusConfig& bus = config.buses.at(static_cast<std::size_t>(b));
  options.own_id = static_cast<std::uint8_t>(bus.node_id);
  options.sync_overflow = static_cast<std::uint8_t>(bus.sync_counter);
  options.request_interval =
      static_cast<int>(std::lround(config.trafficOf(b, heartbeat_budget).request_interval / config.period));
  options.heartbeat_period = static_cast<std::int64_t>(1e9 * heartbeat_budget / kHeartbeatsPerBudget);
  options.master_silence = nanoseconds(canopen::listeningTime(heartbeat_budget));
  return options;
}

}  // namespace

CanopenBus::CanopenBus(can::Bus& bus, const HardwareConfig& hardware, int index, const safety::Budgets& budgets)
    : network_(bus, networkOptions(hardware, index, budgets.drive_heartbeat)),
      listening_time_(canopen::listeningTime(budgets.drive_heartbeat)),
      bit_rate_(hardware.buses[static_cast<std::size_t>(index)].bit_rate) {}

Cia402Driver& CanopenBus::addAxis(const HardwareConfig& hardware,
                                  const AxisConfig& axis,
                                  const safety::Budgets& budgets) {
  drivers_.push_back(std::make_unique<Cia402Driver>(hardware, axis, network_, budgets));
  axis_of_node_.resize(static_cast<std::size_t>(network_.nodeCount()), static_cast<int>(drivers_.size()) - 1);
  return *drivers_.back();
}

void CanopenBus::start(std::int64_t) noexcept { network_.setHeartbeat(true); }

void CanopenBus::receive(std::int64_t now) noexcept {
  network_.receive(now);
  measureLoad(now);
}

void CanopenBus::transmit(std::int64_t now, bool moving) noexcept { network_.transmit(now, {true, true, moving}); }

void CanopenBus::measureLoad(std::int64_t now) noexcept {
  if (window_ != 0 && now - window_ < kSecond)
    return;
  const can::BusCounters& counters = network_.bus().counters();
  const double bits = trafficBits(counters.sent + counters.received, counters.data_bytes);
  if (window_ != 0)
    load_ = (bits - bits_) / (1e-9 * static_cast<double>(now - window_)) / bit_rate_;
  bits_ = bits;
  window_ = now;
}

bool CanopenBus::nextEvent(FieldbusEvent& event) noexcept {
  using Kind = canopen::NetworkEvent::Kind;
  canopen::NetworkEvent found;
  while (network_.nextEvent(found)) {
    if (found.kind == Kind::kPhase && found.phase != canopen::NodePhase::kFailed)
      continue;
    event = {};
    report(found, event);
    return true;
  }
  return false;
}

void CanopenBus::report(const canopen::NetworkEvent& found, FieldbusEvent& event) noexcept {
  using Kind = canopen::NetworkEvent::Kind;
  if (found.kind == Kind::kBusState) {
    event.kind = FieldbusEvent::Kind::kState;
    event.state = found.bus_state;
    return;
  }
  if (found.kind == Kind::kMaster) {
    event.kind = FieldbusEvent::Kind::kMaster;
    event.master = static_cast<std::uint8_t>(found.master);
    return;
  }
  event.axis = axis_of_node_[static_cast<std::size_t>(found.node)];
  Cia402Driver& driver = *drivers_[static_cast<std::size_t>(event.axis)];
  event.encoder = driver.isEncoder(found.node);
  if (found.kind == Kind::kEmcy) {
    driver.onEmcy(found.node, found.emcy);
    event.kind = FieldbusEvent::Kind::kEmergency;
    event.code = found.emcy.code;
  } else {
    event.kind = FieldbusEvent::Kind::kFailure;
    event.failure = deviceFailure(network_.node(found.node).failure());
  }
}

FieldbusCounters CanopenBus::counters() const noexcept {
  const can::BusCounters& counters = network_.bus().counters();
  return {counters.sent, counters.received, counters.tx_dropped + counters.tx_failed, counters.rx_overflow};
}

std::string CanopenBus::describeMaster(std::uint8_t master) const {
  const auto frame = static_cast<canopen::MasterFrame>(master);
  const std::string received = ": " + std::string(canopen::name(frame)) + " from another master";
  if (frame == canopen::MasterFrame::kSdoRequest)
    return received + "; two SDO clients of one node disturb each other's parameter access";
  return received + "; stop it, then `tandem robot disable`";
}

std::vector<std::unique_ptr<Fieldbus>> canopenBuses(const HardwareConfig& hardware,
                                                    const std::vector<can::Bus*>& buses,
                                                    const safety::Budgets& budgets) {
  std::vector<std::unique_ptr<Fieldbus>> result;
  for (std::size_t b = 0; b < buses.size(); ++b)
    result.push_back(std::make_unique<CanopenBus>(*buses[b], hardware, static_cast<int>(b), budgets));
  return result;
}

}  // namespace tandem::hal
