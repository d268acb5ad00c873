// SPDX-License-Identifier: Apache-2.0
#include "services/drive_sim/report.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace tandem::drive_sim {
namespace {

using nlohmann::json;
using sim::drives::DriveBus;

json describeDevice(const DriveBus& bus, sim::drives::Device& device) {
  json faults = json::array();
  for (int k = 0; k < sim::drives::kFaultKinds; ++k) {
    const auto kind = static_cast<sim::drives::FaultKind>(k);
    if (bus.has(device.id(), kind))
      faults.push_back(name(kind));
  }
  const sim::drives::DeviceCounters& c = device.counters();
  return {{"id", device.id()},
          {"powered", device.powered()},
          {"nmt", hal::canopen::name(device.nmt())},
          {"error", device.lastError()},
          {"injected", faults},
          {"frames_in", c.frames_in},
          {"frames_out", c.frames_out},
          {"rpdos", c.rpdos},
          {"bad_rpdos", c.bad_rpdos},
          {"syncs", c.syncs},
          {"sdo_requests", c.sdo_requests},
          {"emergencies", c.emergencies},
          {"heartbeats_lost", c.heartbeats_lost},
          {"rpdo_timeouts", c.rpdo_timeouts},
          {"boots", c.boots}};
}

json describeDrive(const DriveBus& bus, sim::drives::Drive& drive) {
  json result = describeDevice(bus, drive);
  const sim::drives::DriveRecord& r = drive.record();
  result.update({{"state", name(drive.state())},
                 {"mode", drive.mode()},
                 {"position", drive.position()},
                 {"demand", drive.demand()},
                 {"velocity", drive.motor().velocity()},
                 {"temperature", drive.motor().temperature()},
                 {"max_following_error", r.max_following_error},
                 {"max_jump", r.max_jump},
                 {"limit_hits", r.limit_hits},
                 {"quick_stops", r.quick_stops},
                 {"faults", r.faults},
                 {"contact_losses", r.contact_losses},
                 {"travel", r.travel},
                 {"lowest", r.lowest},
                 {"highest", r.highest},
                 {"peak_velocity", r.peak_velocity},
                 {"stop_begin", 1e-9 * static_cast<double>(r.stop_begin)},
                 {"stop_travel", r.stop_travel},
                 {"stop_duration", r.stop_duration},
                 {"longest_silence", r.longest_silence}});
  return result;
}

}  // namespace

std::string reportState(DriveBus& bus) {
  json drives = json::array(), encoders = json::array();
  for (const auto& drive : bus.drives())
    drives.push_back(describeDrive(bus, *drive));
  for (const auto& encoder : bus.encoders()) {
    json one = describeDevice(bus, *encoder);
    one["position"] = encoder->position();
    one["drive"] = encoder->spec().drive;
    encoders.push_back(one);
  }
  const sim::drives::BusRecord& r = bus.record();
  return json{{"bus",
               {{"name", bus.bus().name()},
                {"received", r.received},
                {"sent", r.sent},
                {"unsent", r.unsent},
                {"dropped", r.dropped},
                {"lost", r.lost},
                {"flipped", r.flipped},
                {"babbled", r.babble_frames},
                {"off", bus.has(0, sim::drives::FaultKind::kBusOff)}}},
              {"drives", drives},
              {"encoders", encoders}}
      .dump();
}

std::string serveLine(DriveBus& bus, const std::string& line) {
  using sim::drives::FaultCommand;
  try {
    const FaultCommand command = sim::drives::parseFaultCommand(line);
    switch (command.kind) {
      case FaultCommand::Kind::kInject:
        return bus.inject(command.injection)
                   ? "ok"
                   : "error: node " + std::to_string(command.injection.node) + " cannot have the fault " +
                         std::string(name(command.injection.kind));
      case FaultCommand::Kind::kClear:
        return bus.clear(command.node, command.fault) > 0
                   ? "ok"
                   : "error: node " + std::to_string(command.node) + " has no such fault";
      case FaultCommand::Kind::kTurn:
        for (const auto& drive : bus.drives()) {
          if (drive->id() != command.node)
            continue;
          drive->motor().turn(command.counts);
          return "ok";
        }
        return "error: node " + std::to_string(command.node) + " is no drive";
      case FaultCommand::Kind::kMark:
        bus.mark();
        return "ok";
      case FaultCommand::Kind::kState:
        break;
    }
    return reportState(bus);
  } catch (const std::invalid_argument& error) {
    return "error: " + std::string(error.what());
  }
}

}  // namespace tandem::drive_sim
