// SPDX-License-Identifier: Apache-2.0
/** @file Colours of arms, their tubes and the grasped object: the only definition, of the operator's page (through
 * GET /api/robot) and of the markers.
 *
 * Hues of Okabe and Ito, distinguishable with every kind of colour vision: blue for the first arm, orange for the
 * second. The tubes of an arm differ by lightness, the innermost is the lightest. */
#pragma once

#include <array>
#include <string>

namespace tandem::console {

/// "#rrggbb" of an arm as a whole. @param arm  index from 0
std::string armColor(int arm);
/// "#rrggbb" of a tube; the only tube of an arm has the arm's colour. @param tube  of `count`, index from 0
std::string tubeColor(int arm, int tube, int count);
/// "#rrggbb" of the grasped object.
std::string objectColor();
/// Red, green, blue from 0 to 1, and opacity. @param color  "#rrggbb"
std::array<float, 4> rgba(const std::string& color, float opacity = 1.0f);

}  // namespace tandem::console
