// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/protections.h"

#include <array>
#include <string_view>

namespace tandem::hal {
namespace {

/// Objects of each protection.
constexpr std::array<std::string_view, kProtectionCount> kObjects{
    "1400:05", "1016:01; 100C, 100D", "6007", "605A, 6085", "605E", "6065, 6066", "607D", "6080, 607F"};

}  // namespace

std::string describeProtections(ProtectionMask protections) {
  std::string text;
  for (std::size_t k = 0; k < kObjects.size(); ++k) {
    const auto protection = static_cast<Protection>(k);
    if ((protections & bit(protection)) != 0)
      text +=
          std::string(text.empty() ? "" : ", ") + std::string(name(protection)) + " (" + std::string(kObjects[k]) + ")";
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

std::vector<ProtectionMask> missingProtections(ProtectionMask lost, const std::vector<AcceptedLoss>& accepted) {
  std::vector<ProtectionMask> missing = leastProtections(accepted);
  std::erase_if(missing, [lost](ProtectionMask set) { return (set & ~lost) != 0; });
  return missing;
}

}  // namespace tandem::hal
