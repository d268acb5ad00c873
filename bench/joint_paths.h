// SPDX-License-Identifier: Apache-2.0
/** @file Arms and joint vectors for benchmarks of the kinematic models. */
#pragma once

#include <cstdint>
#include <vector>

#include "kinematics/concentric_tube.h"

namespace tandem::bench {

/// The arm of the preset ark2024 (Alsaka et al. 2024), or timc2024 (Boyer et al. 2024).
kinematics::ConcentricTubeArm arkArm();
kinematics::ConcentricTubeArm timcArm();

/// arkArm() with two, three or four tubes: without the outermost, or with a shorter, wider one around it.
kinematics::ConcentricTubeArm arkArm(int tubes);

/// Whether curved parts of two tubes overlap beyond the entry point, so that torsion couples them.
bool overlapping(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q);

/// `count` random joint vectors with or without such an overlap.
std::vector<Eigen::VectorXd> randomJoints(const kinematics::ConcentricTubeArm& arm,
                                          bool overlap,
                                          int count,
                                          std::uint32_t seed);

/// A smooth path of `count` steps of `period` seconds: translations within +-5 mm, rotations within +-0.2 rad of a
/// random start, one turn of the slowest joint in 10 s (5 mm/s, 0.2 rad/s at most).
std::vector<Eigen::VectorXd> controlPath(const kinematics::ConcentricTubeArm& arm,
                                         bool overlap,
                                         double period,
                                         int count,
                                         std::uint32_t seed);

}  // namespace tandem::bench
