// SPDX-License-Identifier: Apache-2.0
#include "services/cli/can/sheet.h"

#include <algorithm>
#include <cctype>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "config/config.h"
#include "hal/canopen/bytes.h"
#include "sim/drives/eds.h"

namespace tandem::cli {
namespace {

using hal::canopen::DataType;

bool isText(const std::vector<std::uint8_t>& data) {
  return data.size() > 4 && std::all_of(data.begin(), data.end(), [](std::uint8_t b) { return std::isprint(b) != 0; });
}

std::string hexText(const std::vector<std::uint8_t>& data) {
  std::string text;
  char byte[4];
  for (const std::uint8_t b : data) {
    std::snprintf(byte, sizeof byte, "%02X", b);
    text += byte;
  }
  return text;
}

/// A value as numbers: unsigned, and signed by its length.
struct ObjectNumbers {
  std::uint64_t raw = 0;
  std::int64_t as_signed = 0;
};
ObjectNumbers objectNumbers(const std::vector<std::uint8_t>& data) {
  const std::uint64_t raw = hal::canopen::fromBytes(data);
  const int bits = static_cast<int>(std::clamp<std::size_t>(8 * data.size(), 8, 64));
  return {raw, hal::canopen::signExtend(raw, bits)};
}

/// An integer type of this size.
bool isInteger(std::optional<DataType> type, const std::vector<std::uint8_t>& data) {
  return type && !isReal(*type) && !data.empty() && sizeOf(*type) == static_cast<int>(data.size());
}

}  // namespace

nlohmann::ordered_json valueJson(const std::vector<std::uint8_t>& data, std::optional<DataType> type) {
  nlohmann::ordered_json json{{"bytes", data.size()}};
  if (isText(data)) {
    json["text"] = std::string(data.begin(), data.end());
  } else if (data.size() > 8) {
    json["hex"] = hexText(data);
  } else {
    json["unsigned"] = objectNumbers(data).raw;
    json["signed"] = objectNumbers(data).as_signed;
    if (isInteger(type, data))
      json["value"] = isSigned(*type) ? json["signed"] : json["unsigned"];
  }
  return json;
}

std::string valueText(const std::vector<std::uint8_t>& data, std::optional<DataType> type) {
  if (isText(data))
    return "\"" + std::string(data.begin(), data.end()) + "\"";
  const std::string bytes = " (" + std::to_string(data.size()) + (data.size() == 1 ? " byte)" : " bytes)");
  if (data.size() > 8)
    return hexText(data) + bytes;
  const ObjectNumbers numbers = objectNumbers(data);
  const std::string as_signed = std::to_string(numbers.as_signed), as_unsigned = std::to_string(numbers.raw);
  const std::string number = !isInteger(type, data) ? as_unsigned + ", signed " + as_signed
                             : isSigned(*type)      ? as_signed
                                                    : as_unsigned;
  char hex[32];
  std::snprintf(hex, sizeof hex, ", 0x%0*llX", static_cast<int>(2 * data.size()),
                static_cast<unsigned long long>(numbers.raw));
  return number + hex + bytes;
}

hal::canopen::Eds loadSheet(const std::string& path) {
  try {
    return hal::canopen::loadEds(path);
  } catch (const std::exception& error) {
    throw Failure(kUsage, error.what());
  }
}

void printWarnings(const hal::canopen::Eds& sheet, std::size_t most) {
  for (std::size_t k = 0; k < std::min(most, sheet.warnings.size()); ++k)
    std::cerr << "warning: " << describe(sheet, sheet.warnings[k]) << '\n';
  if (sheet.warnings.size() > most)
    std::cerr << "warning: " << sheet.file << ": " << sheet.warnings.size() - most << " more warnings\n";
}

std::string nameIn(const hal::canopen::Eds& sheet, hal::canopen::ObjectAddress object) {
  const hal::canopen::EdsObject* found = sheet.find(object);
  return found == nullptr ? "" : found->name;
}

std::optional<DataType> typeIn(const hal::canopen::Eds& sheet, hal::canopen::ObjectAddress object) {
  const hal::canopen::EdsObject* found = sheet.find(object);
  const bool of_manufacturer = object.index >= 0x2000 && object.index < 0x6000;
  for (const hal::canopen::Eds* standard : {&sim::drives::driveEds(), &sim::drives::encoderEds()}) {
    if (found == nullptr && !of_manufacturer)
      found = standard->find(object);
  }
  return found == nullptr ? std::nullopt : std::optional(found->type);
}

std::string needOf(const hal::canopen::SetupStep& step) {
  std::string names;
  for (int k = 0; k < hal::kProtectionCount; ++k) {
    const auto protection = static_cast<hal::Protection>(k);
    if ((step.protections & hal::bit(protection)) != 0)
      names += (names.empty() ? "" : ", ") + std::string(name(protection));
  }
  return !names.empty() ? names : step.optional ? "optional" : "required";
}

int showProtections(const CanOptions& options, CanTool& tool, int node) {
  const double heartbeat = safety::Budgets{}.drive_heartbeat;
  // Any axis: all have the same protections.
  const hal::HardwareConfig hardware =
      config::loadHardware(config::findFile("ark2024-two-buses", "hardware"), heartbeat, false);
  hal::AxisConfig axis = hardware.axes.front();
  axis.node = node;
  hal::ProtectionMask lost = 0;
  std::map<hal::canopen::ObjectAddress, std::string> absent;
  for (const hal::canopen::SetupStep& step : hal::setupSteps(hardware, axis, heartbeat)) {
    std::vector<std::uint8_t> data;
    if (step.protections == 0 || tool.tryRead(node, step.object, data) == hal::canopen::SdoAbort::kNone)
      continue;
    lost |= step.protections;
    absent[step.object] = step.what;
  }
  std::string missing;
  for (const hal::ProtectionMask set : hal::leastProtections({}))
    missing += (set & ~lost) == 0 ? (missing.empty() ? "" : "; ") + hal::describeProtections(set) : "";
  constexpr hal::ProtectionMask kAll = (1u << hal::kProtectionCount) - 1;
  if (options.json) {
    nlohmann::ordered_json json{{"node", node}, {"objects_absent", nlohmann::ordered_json::array()}};
    for (int k = 0; k < hal::kProtectionCount; ++k)
      json[std::string(name(static_cast<hal::Protection>(k)))] =
          (lost & hal::bit(static_cast<hal::Protection>(k))) == 0;
    for (const auto& [object, what] : absent)
      json["objects_absent"].push_back(describe(object));
    json["boots"] = missing.empty();
    std::cout << json.dump() << '\n';
  } else {
    std::cout << "node " << node << " has objects for: " << hal::describeProtections(kAll & ~lost) << '\n'
              << "lacks: " << hal::describeProtections(lost) << '\n';
    for (const auto& [object, what] : absent)
      std::cout << "  " << describe(object) << " " << what << " is absent\n";
    if (!missing.empty())
      std::cout << "tandem-hal refuses it unless its axis accepts the loss of: " << missing << '\n';
  }
  return missing.empty() ? kOk : kFailure;
}

}  // namespace tandem::cli
