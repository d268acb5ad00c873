// SPDX-License-Identifier: Apache-2.0
#include "services/console/palette.h"

#include <algorithm>

namespace tandem::console {
namespace {

constexpr std::array<std::array<const char*, 4>, 4> kTubes{{{"#bfe3f7", "#56b4e9", "#0072b2", "#004a75"},
                                                            {"#fbdca1", "#e69f00", "#d55e00", "#8a3d00"},
                                                            {"#9fe0cb", "#1fb88d", "#009e73", "#00684c"},
                                                            {"#f2cfe2", "#cc79a7", "#a8427c", "#702b52"}}};
constexpr int kArm = 1;  // the tube whose colour stands for the arm

}  // namespace

std::string tubeColor(int arm, int tube, int count) {
  const auto& tubes = kTubes[static_cast<std::size_t>(arm) % kTubes.size()];
  return tubes[static_cast<std::size_t>(count > 1 ? std::clamp(tube, 0, 3) : kArm)];
}

std::string armColor(int arm) { return tubeColor(arm, kArm, 1); }

std::string objectColor() { return "#7fbf3f"; }

std::array<float, 4> rgba(const std::string& color, float opacity) {
  const auto part = [&](std::size_t at) {
    return static_cast<float>(std::stoi(color.substr(at, 2), nullptr, 16)) / 255.0f;
  };
  return {part(1), part(3), part(5), opacity};
}

}  // namespace tandem::console
