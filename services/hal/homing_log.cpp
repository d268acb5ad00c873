// SPDX-License-Identifier: Apache-2.0
#include "services/hal/homing_log.h"

#include <algorithm>
#include <utility>

#include "services/runtime/identity.h"
#include "services/runtime/joint_text.h"

namespace tandem::hal_service {
namespace {

constexpr const char* kWhat = "home the drives";
constexpr std::int64_t kAgain =
    1'000'000'000;  // ns after which a request is a new one; a run without requests has ended
constexpr std::size_t kMostClients = 100;

}  // namespace

std::string HomingLog::describe(const HalAnswer& answer) const {
  std::string arms;
  for (std::size_t a = 0; a < robot_.arms.size(); ++a) {
    std::string joints;
    for (std::size_t j = 0; j < robot_.arms[a].joint_names.size(); ++j) {
      if ((answer.not_homed[a] >> j & 1) != 0)
        joints += (joints.empty() ? "" : ", ") + robot_.arms[a].joint_names[j];
    }
    if (!joints.empty())
      arms += (arms.empty() ? " of " : " and ") + robot_.arms[a].name + " (" + joints + ")";
  }
  return kWhat + arms;
}

HomingLog::Line HomingLog::measured(const HalAnswer& answer, const std::optional<dds::Identity>& who) const {
  std::string what = "take a measured position";
  if (answer.arm < robot_.arms.size() && answer.joint < robot_.arms[answer.arm].joint_names.size()) {
    const config::Arm& arm = robot_.arms[answer.arm];
    what += " of " + arm.name + " (" + arm.joint_names[answer.joint] +
            "): " + runtime::jointText(answer.position, arm.limits.isTranslation(answer.joint));
  }
  if (answer.code != dds::ReplyCode::kOk)
    return {runtime::refusalLine(what + ": " + answer.reason.data(), answer.client, who), true};
  return {runtime::requestLine(what, answer.client, who), false};
}

HomingLog::Line HomingLog::answered(const HalAnswer& answer,
                                    const std::optional<dds::Identity>& who,
                                    std::int64_t now) {
  if (answer.kind == static_cast<std::uint8_t>(dds::HalKind::kMeasured))
    return measured(answer, who);
  std::erase_if(runs_,
                [now](const auto& run) { return run.second.said != Said::kBegin && now - run.second.last > kAgain; });
  if (runs_.size() >= kMostClients && !runs_.contains(answer.client))
    return {};
  const auto [found, first] = runs_.try_emplace(answer.client);
  Run& run = found->second;
  if (first)
    run.what = describe(answer);
  run.who = who;
  run.last = now;
  if (answer.code != dds::ReplyCode::kOk) {
    const std::string refusal = answer.reason.data();
    if (std::exchange(run.refusal, refusal) == refusal)
      return {};
    run.said = Said::kNothing;
    return {runtime::refusalLine(run.what + ": " + refusal, answer.client, who), true};
  }
  const Said now_said = answer.value == 0 ? Said::kBegin : Said::kDone;
  if (std::exchange(run.said, now_said) == now_said)
    return {};
  const char* result = "";
  if (now_said == Said::kDone)
    result = run.what == kWhat ? ": nothing to do, all joints are homed" : ": done";
  return {runtime::requestLine(run.what + result, answer.client, who), false};
}

HomingLog::Line HomingLog::look(std::int64_t now) {
  const auto ended = std::find_if(runs_.begin(), runs_.end(), [now](const auto& run) {
    return run.second.said == Said::kBegin && now - run.second.last > kAgain;
  });
  if (ended == runs_.end())
    return {};
  const auto [client, run] = *ended;
  runs_.erase(ended);
  return {runtime::requestLine(run.what + ": ended before the joints were homed", client, run.who), false};
}

}  // namespace tandem::hal_service
