// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/protections.h"

#include <array>

namespace tandem::hal {
namespace {

struct Text {
  std::string_view name, objects;
};
constexpr std::array<Text, kProtectionCount> kTexts{{{"command_deadline", "1400:05"},
                                                     {"heartbeat_watch", "1016:01"},
                                                     {"connection_reaction", "6007"},
                                                     {"quick_stop_ramp", "605A, 6085"},
                                                     {"fault_reaction", "605E"},
                                                     {"following_error", "6065, 6066"}}};

}  // namespace

std::string_view name(Protection protection) { return kTexts[static_cast<std::size_t>(protection)].name; }

std::string describeProtections(ProtectionMask protections) {
  std::string text;
  for (std::size_t k = 0; k < kTexts.size(); ++k) {
    if ((protections & bit(static_cast<Protection>(k))) != 0)
      text += std::string(text.empty() ? "" : ", ") + std::string(kTexts[k].name) + " (" +
              std::string(kTexts[k].objects) + ")";
  }
  return text.empty() ? "none" : text;
}

std::vector<ProtectionMask> leastProtections(const std::vector<AcceptedLoss>& accepted) {
  std::vector<ProtectionMask> sets{bit(Protection::kCommandDeadline) | bit(Protection::kHeartbeatWatch),
                                   bit(Protection::kConnectionReaction), bit(Protection::kQuickStopRamp)};
  for (const AcceptedLoss& loss : accepted)
    std::erase_if(sets, [&](ProtectionMask set) { return (set & bit(loss.protection)) != 0; });
  return sets;
}

}  // namespace tandem::hal
