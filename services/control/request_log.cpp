// SPDX-License-Identifier: Apache-2.0
#include "services/control/request_log.h"

#include <algorithm>

#include "idl/enumerations.h"
#include "services/runtime/identity.h"

namespace tandem::control_service {
namespace {

constexpr std::int64_t kAgain = 1'000'000'000;  // ns after which a repeated request is a new one
constexpr std::size_t kMostRepeated = 100;
constexpr std::size_t kLongest = 80;  // bytes of a client's text

/// As the page and the command line name arms: "arm_a" is "A".
std::string shortName(std::string arm) {
  if (arm.starts_with("arm_"))
    arm.erase(0, 4);
  std::transform(arm.begin(), arm.end(), arm.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return arm;
}

}  // namespace

std::string describeRequest(const dds::ControlRequest& request, const std::vector<std::string>& arms) {
  const auto kind = static_cast<dds::ControlKind>(request.kind);
  const std::string arm = request.arm < arms.size() ? " of arm " + shortName(arms[request.arm]) : "";
  const std::string text = request.text.substr(0, kLongest), value = request.value.substr(0, kLongest);
  switch (kind) {
    case dds::ControlKind::kKeepLease:
      return "";
    case dds::ControlKind::kStateCommand:
      return value + arm;
    case dds::ControlKind::kSetMethod:
      return "method " + text;
    case dds::ControlKind::kSetParameter:
      return text + " = " + value;
    default: {
      std::string name(idl::name(kind));
      std::replace(name.begin(), name.end(), '_', ' ');
      return name + arm;
    }
  }
}

std::string RequestLog::line(const dds::ControlRequest& request,
                             const std::optional<dds::Identity>& who,
                             std::int64_t now) {
  const std::string what = describeRequest(request, arms_);
  if (what.empty())
    return "";
  const std::string line = runtime::requestLine(what, request.client, who);
  const auto kind = static_cast<dds::ControlKind>(request.kind);
  if (kind != dds::ControlKind::kJog && kind != dds::ControlKind::kHold)
    return line;
  if (repeated_.size() > kMostRepeated)
    repeated_.clear();
  const auto [last, first] = repeated_.try_emplace(line, now);
  const bool again = !first && now - last->second < kAgain;
  last->second = now;
  return again ? "" : line;
}

}  // namespace tandem::control_service
