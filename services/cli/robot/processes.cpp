// SPDX-License-Identifier: Apache-2.0
#include "services/cli/robot/processes.h"

#include <cstdio>

#include "config/values.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/identity.h"

namespace tandem::cli {

nlohmann::ordered_json processesJson(const client::Client& client) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  const std::int64_t now = runtime::wallNow();
  for (const dds::Identity& other : client.bus().others()) {
    if (other.moves == 0)
      continue;
    json.push_back({{"process", other.process},
                    {"host", other.host},
                    {"pid", other.pid},
                    {"robot", other.robot},
                    {"deployment", other.deployment},
                    {"fingerprint", config::fingerprintText(other.fingerprint)},
                    {"up_s", 1e-9 * static_cast<double>(now - other.started)},
                    {"mismatch", runtime::mismatch(client.bus().options().identity, other)}});
  }
  return json;
}

nlohmann::ordered_json diagnosticsJson(const client::Snapshot& s) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [service, status] : s.diagnostics) {
    nlohmann::ordered_json values = nlohmann::ordered_json::object();
    for (const auto& [name, value] : status.values)
      values[name] = value;
    json[service] = {{"level", status.level}, {"message", status.message}, {"values", values}};
  }
  return json;
}

nlohmann::ordered_json clocksJson(const std::vector<client::ClockOffset>& offsets) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const client::ClockOffset& clock : offsets)
    json.push_back({{"host", clock.host}, {"offset_s", clock.offset}, {"within_s", clock.within}});
  return json;
}

void requestAll(client::Client& client) {
  constexpr int kTimes = 8;
  constexpr double kPause = 0.03;  // s
  for (int i = 0; i < kTimes; ++i) {
    client.clocks().requestTimes();
    client.waitFor(kPause, [](const client::Snapshot&) { return false; });
  }
}

void printProcesses(const nlohmann::ordered_json& json) {
  for (const auto& process : json["processes"]) {
    std::printf("  %s: pid %u on %s, up %.0f s\n", process["process"].get<std::string>().c_str(),
                process["pid"].get<unsigned>(), process["host"].get<std::string>().c_str(),
                process["up_s"].get<double>());
    if (const auto words = process["mismatch"].get<std::string>(); !words.empty())
      std::printf("    MISMATCH: %s\n", words.c_str());
  }
  for (const auto& clock : json["clocks"]) {
    const std::string host = clock["host"].get<std::string>();
    if (!host.empty())  // a deployment without hosts has one clock
      std::printf("  clock of %s: %+.3f ms against this one's, within %.3f ms\n", host.c_str(),
                  1e3 * clock["offset_s"].get<double>(), 1e3 * clock["within_s"].get<double>());
  }
}

}  // namespace tandem::cli
