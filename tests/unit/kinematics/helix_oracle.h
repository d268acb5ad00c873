// SPDX-License-Identifier: Apache-2.0
/** @file Helical tubes, for the oracles: written apart from kinematics/concentric_tube.h, which they judge. */
#pragma once

#include <algorithm>

#include "kinematics/concentric_tube.h"

namespace tandem::test {

/// Angle by which the direction of bending turns about a tube between its motor, at beta (m), and the entry point, rad.
inline double turnBehindEntry(const kinematics::Tube& tube, double beta) {
  double angle = 0.0, begin = beta;
  for (const kinematics::TubeSection& section : tube.sections) {
    const double end = begin + section.length;
    angle += section.helix_torsion * (std::min(end, 0.0) - std::min(begin, 0.0));
    begin = end;
  }
  return angle;
}

}  // namespace tandem::test
