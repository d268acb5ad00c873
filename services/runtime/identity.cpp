// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/identity.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>

#include "config/values.h"
#include "idl/version.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/process.h"

namespace tandem::runtime {
namespace {

/// Processes whose commands and measurements move the robot.
const std::set<std::string> kMovers{"control", "planning", "hal", "sim"};

std::string machineName() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// The value of a key in `values`; empty if absent.
std::string valueOf(const std::string& values, const std::string& key) {
  const std::size_t at = ("\n" + values).find("\n" + key + ": ");
  if (at == std::string::npos)
    return {};
  const std::size_t begin = at + key.size() + 2;
  return values.substr(begin, values.find('\n', begin) - begin);
}

std::string nameOf(std::uint64_t client, const std::optional<dds::Identity>& who) {
  char number[8];
  std::snprintf(number, sizeof number, "%04x", static_cast<unsigned>(client & 0xffff));
  return who ? "tandem-" + describe(*who) : std::string("client ") + number;
}

}  // namespace

std::uint64_t fingerprintOf(const config::Deployment& deployment) noexcept {
  return config::fingerprintOf(deployment.values, idl::kWireVersion);
}

dds::Identity identityOf(const config::Deployment& deployment, const std::string& process) {
  static const std::int64_t started = wallNow();
  dds::Identity identity;
  identity.wire_version = idl::kWireVersion;
  identity.values = deployment.values;
  identity.fingerprint = fingerprintOf(deployment);
  identity.session = randomIdentity();
  identity.process = process;
  identity.host = machineName();
  identity.pid = static_cast<std::uint32_t>(::getpid());
  identity.started = started;
  identity.robot = valueOf(deployment.values, "robot.name");
  identity.deployment = deployment.name;
  identity.moves = kMovers.contains(process) ? 1 : 0;
  return identity;
}

std::string describe(const dds::Identity& identity) {
  return identity.process + " (pid " + std::to_string(identity.pid) + " on " + identity.host + ")";
}

std::string requestLine(const std::string& what, std::uint64_t client, const std::optional<dds::Identity>& who) {
  return "request: " + what + ", by " + nameOf(client, who);
}

std::string refusalLine(const std::string& reason, std::uint64_t client, const std::optional<dds::Identity>& who) {
  return "request refused: " + reason + ", by " + nameOf(client, who);
}

std::string describeThisProcess(const std::string& process) {
  dds::Identity identity;
  identity.process = process;
  identity.host = machineName();
  identity.pid = static_cast<std::uint32_t>(::getpid());
  return describe(identity);
}

std::string mismatch(const dds::Identity& ours, const dds::Identity& theirs) {
  if (ours.fingerprint == theirs.fingerprint)
    return {};
  const std::string who = describe(theirs);
  if (ours.wire_version != theirs.wire_version)
    return who + " uses another wire version (" + config::fingerprintText(theirs.wire_version) + ", here " +
           config::fingerprintText(ours.wire_version) + "): install the same release on both sides";
  return who + " uses another robot or deployment: " + config::differences(ours.values, theirs.values);
}

std::vector<std::string> mismatches(const dds::Bus& bus) {
  std::vector<std::string> all;
  for (const dds::Identity& other : bus.others()) {
    if (const std::string description = mismatch(bus.options().identity, other);
        !description.empty() && other.moves != 0)
      all.push_back(description);
  }
  return all;
}

MismatchHandler::MismatchHandler(dds::Bus& bus,
                                 std::function<void(const dds::Reply&)> answer,
                                 std::function<void()> stop)
    : bus_(bus), answer_(std::move(answer)), stop_(std::move(stop)) {
  bus_.onMismatch([this](const dds::Mismatch& met) { meet(met); });
}

MismatchHandler::~MismatchHandler() { bus_.onMismatch({}); }

void MismatchHandler::meet(const dds::Mismatch& met) {
  if (met.client == 0)
    stop_();
  if (met.fingerprint == reported_ && met.request == 0)
    return;
  if (met.client != 0 && isForOtherService(met))
    return;
  const std::string description = describe(met);
  spdlog::error("{}: ignored: {}", met.topic, description);
  reported_ = met.fingerprint;
  if (met.request != 0)
    answer_({met.client, met.request, 0, static_cast<std::uint16_t>(dds::ReplyCode::kMismatch), description, 0});
}

bool MismatchHandler::isForOtherService(const dds::Mismatch& met) const {
  const auto others = bus_.others();
  return std::ranges::any_of(others, [&](const dds::Identity& other) {
    return other.process == bus_.options().identity.process && other.fingerprint == met.fingerprint;
  });
}

std::string MismatchHandler::describe(const dds::Mismatch& met) const {
  for (const dds::Identity& other : bus_.others()) {
    if (other.fingerprint == met.fingerprint)
      return mismatch(bus_.options().identity, other);
  }
  return "the sender uses another robot or deployment, or none (fingerprint " +
         config::fingerprintText(met.fingerprint) + ", expected " +
         config::fingerprintText(bus_.options().identity.fingerprint) + "; `tandem validate DEPLOYMENT` prints it)";
}

}  // namespace tandem::runtime
