// SPDX-License-Identifier: Apache-2.0
#include "services/client/diagnostic_details.h"

namespace tandem::client {

nlohmann::ordered_json diagnosticDetails(const Snapshot& snapshot, const std::string& prefix) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [service, status] : snapshot.diagnostics) {
    for (const auto& [key, value] : status.values) {
      if (key.starts_with(prefix))
        json[service][key.substr(prefix.size())] = value;
    }
  }
  return json;
}

std::string describeFailed(const nlohmann::ordered_json& failed, const std::string& indent) {
  std::string text;
  for (const auto& [service, devices] : failed.items()) {
    for (const auto& [device, why] : devices.items())
      text += indent + device + " failed: " + why.get<std::string>() + '\n';
  }
  return text;
}

}  // namespace tandem::client
