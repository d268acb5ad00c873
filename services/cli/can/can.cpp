// SPDX-License-Identifier: Apache-2.0
/** @file tandem can scan and od: nodes of a bus, entries of their object dictionaries. */
#include "services/cli/can/can.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "hal/canopen/bytes.h"
#include "hal/drives/cia402.h"
#include "services/cli/can/sheet.h"

namespace tandem::cli {
namespace {

using hal::canopen::ObjectAddress;

/// Device type and identity of one node.
struct FoundNode {
  std::uint32_t type = 0;
  std::map<int, std::uint32_t> identity;  ///< by sub-index of 0x1018
  std::string name;
  std::optional<std::uint16_t> statusword;
};

std::string profileName(std::uint32_t type) {
  switch (type & 0xFFFF) {
    case 402:
      return "402 drive";
    case 406:
      return "406 encoder";
    default:
      return std::to_string(type & 0xFFFF);
  }
}

std::map<int, FoundNode> findNodes(CanTool& tool) {
  std::map<int, FoundNode> found;
  std::vector<int> all(hal::canopen::kMaxNodeId);
  std::iota(all.begin(), all.end(), 1);
  // In batches: most controllers cannot queue 127 requests.
  constexpr std::size_t kBatch = 16;
  for (std::size_t first = 0; first < all.size(); first += kBatch) {
    const std::vector<int> batch(all.begin() + static_cast<long>(first),
                                 all.begin() + static_cast<long>(std::min(first + kBatch, all.size())));
    tool.readMany(batch, {0x1000, 0},
                  [&](int node, const auto& sdo) { found[node].type = static_cast<std::uint32_t>(sdo.value()); });
  }
  std::vector<int> present, drives;
  for (const auto& [node, what] : found) {
    present.push_back(node);
    if ((what.type & 0xFFFF) == 402)
      drives.push_back(node);
  }
  for (const int sub : {1, 2, 3, 4}) {
    tool.readMany(present, {0x1018, static_cast<std::uint8_t>(sub)}, [&](int node, const auto& sdo) {
      found[node].identity[sub] = static_cast<std::uint32_t>(sdo.value());
    });
  }
  tool.readMany(present, {0x1008, 0}, [&](int node, const auto& sdo) {
    std::string& name = found[node].name;
    for (const std::uint8_t byte : sdo.data())
      name += std::isprint(byte) != 0 ? static_cast<char>(byte) : '?';
  });
  tool.readMany(drives, {0x6041, 0},
                [&](int node, const auto& sdo) { found[node].statusword = static_cast<std::uint16_t>(sdo.value()); });
  return found;
}

int scan(const CanOptions& options) {
  constexpr double kHeartbeats = 0.6;  // s: most nodes send a heartbeat within this time
  CanTool tool(options);
  tool.refuseBesideMaster();
  tool.listen(kHeartbeats);
  const std::map<int, FoundNode> found = findNodes(tool);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  if (!options.json)
    std::printf("%4s  %-12s %10s %10s %10s %10s  %-16s %-22s %s\n", "node", "profile", "vendor", "product", "revision",
                "serial", "state", "drive", "name");
  for (const auto& [node, what] : found) {
    const auto id = [&what = what](int sub) { return what.identity.count(sub) != 0 ? what.identity.at(sub) : 0u; };
    const std::string state(name(tool.state(node)));
    const std::string drive(what.statusword ? hal::name(hal::driveState(*what.statusword)) : "");
    if (options.json) {
      json.push_back({{"node", node},
                      {"profile", what.type & 0xFFFF},
                      {"device_type", what.type},
                      {"vendor", id(1)},
                      {"product", id(2)},
                      {"revision", id(3)},
                      {"serial", id(4)},
                      {"name", what.name},
                      {"nmt_state", state},
                      {"drive_state", drive}});
    } else {
      std::printf("%4d  %-12s 0x%08X 0x%08X 0x%08X %10u  %-16s %-22s %s\n", node, profileName(what.type).c_str(), id(1),
                  id(2), id(3), id(4), state.c_str(), drive.c_str(), what.name.c_str());
    }
  }
  if (options.json)
    std::cout << json.dump(2) << '\n';
  if (found.empty())
    std::cerr << "no node answered on " << options.bus << '\n';
  return found.empty() ? kFailure : kOk;
}

void show(const CanOptions& options, int node, ObjectAddress object, const std::vector<std::uint8_t>& data) {
  const hal::canopen::Eds sheet = options.eds.empty() ? hal::canopen::Eds{} : loadSheet(options.eds);
  const std::string name = nameIn(sheet, object);
  if (options.json) {
    nlohmann::ordered_json json{{"node", node}, {"object", describe(object)}};
    if (!options.eds.empty())
      json["name"] = name;
    json.update(valueJson(data, typeIn(sheet, object)));
    std::cout << json.dump() << '\n';
  } else {
    std::cout << describe(object) << (name.empty() ? "" : " " + name) << " = " << valueText(data, typeIn(sheet, object))
              << '\n';
  }
}

std::int64_t parseValue(const std::string& text, std::size_t bytes) {
  const bool negative = text.starts_with("-");
  const std::string_view digits = std::string_view(text).substr(negative ? 1 : 0);
  const bool hex = digits.starts_with("0x");
  std::uint64_t value = 0;
  const char* begin = digits.data() + (hex ? 2 : 0);
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), value, hex ? 16 : 10);
  const int bits = static_cast<int>(8 * bytes);
  const std::uint64_t most = bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
  const std::uint64_t least = std::uint64_t{1} << (bits - 1);
  if (error != std::errc{} || end != text.data() + text.size() || value > (negative ? least : most))
    throw Failure(kUsage, "value '" + text + "', expected a number of " + std::to_string(bytes) + " bytes");
  return negative ? -static_cast<std::int64_t>(value) : static_cast<std::int64_t>(value);
}

int od(const CanOptions& options) {
  const int node = parseNode(options.node);
  if (options.object.empty() != options.protections)
    throw Failure(kUsage, "expected an object, or --protections");
  const ObjectAddress object = options.protections ? ObjectAddress{} : parseObject(options.object);
  CanTool tool(options);
  tool.refuseBesideMaster();
  if (options.protections)
    return showProtections(options, tool, node);
  // The present value gives the length of the new one.
  std::vector<std::uint8_t> data = tool.read(node, object);
  if (!options.value.empty()) {
    if (data.empty() || data.size() > 8)
      throw Failure(kUsage, describe(object) + " is not a number; only numbers can be written");
    hal::canopen::toBytes(static_cast<std::uint64_t>(parseValue(options.value, data.size())), data);
    tool.write(node, object, data);
    data = tool.read(node, object);
  }
  show(options, node, object, data);
  return kOk;
}

}  // namespace

CLI::App* addCanCommand(CLI::App& can,
                        const std::shared_ptr<CanOptions>& options,
                        int& exit_code,
                        const std::string& name,
                        const std::string& text,
                        int (*run)(const CanOptions&)) {
  CLI::App* command = can.add_subcommand(name, text);
  command->add_option("-b,--bus", options->bus, "can:INTERFACE, or unix:SOCKET of a simulated bus")->required();
  command->add_flag("--json", options->json, "JSON instead of text");
  command->add_flag("--force", options->force, "run even if a master is active on the bus");
  command->add_option("--timeout", options->timeout, "time-out of a reply, s")
      ->capture_default_str()
      ->check(client::kPositive);
  command->callback([options, run, &exit_code] { guarded(exit_code, [&] { return run(*options); }); });
  return command;
}

void registerCan(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CanOptions>();
  CLI::App* can =
      app.add_subcommand("can", "CAN buses and CANopen nodes: scan, read and write objects, monitor, record");
  can->require_subcommand(1);
  addCanCommand(*can, options, exit_code, "scan", "list the nodes of a bus: profile, identity, state", scan);
  CLI::App* access = addCanCommand(*can, options, exit_code, "od", "read or write an object of a node, by SDO", od);
  access->add_option("node", options->node, "1 to 127")->required();
  access->add_option("object", options->object, "INDEX or INDEX:SUB, hexadecimal: 6041, 607D:1");
  access->add_option("value", options->value,
                     "value to write (decimal or 0x..., perhaps negative: -3), then read back");
  access->add_option("--eds", options->eds, "data sheet (EDS or DCF) with the names of the objects");
  access->add_flag("--protections", options->protections,
                   "instead of an object: which protections the drive has objects for (docs/hardware.md)");
  registerCanTools(*can, options, exit_code);
  registerCanSheets(*can, options, exit_code);
  registerCanImport(*can, exit_code);
  registerCanMonitor(*can, exit_code);
}

}  // namespace tandem::cli
