// SPDX-License-Identifier: Apache-2.0
/** @file Segmentation of an arm into intervals with constant properties, for all concentric tube models. */
#pragma once

#include <array>

#include "kinematics/tube_model.h"

namespace tandem::kinematics {

/** Intervals of the backbone in front of the entry point, s > 0, at given joints. Every end of a tube section is a
 * boundary; between two boundaries all tubes have constant curvature and stiffness. Boundaries that coincide have
 * intervals of length zero between them, which models skip; no length is rounded. */
struct Segmentation {
  static constexpr int kMaxIntervals = kMaxTubes * kMaxTubeSections;
  static constexpr int kAbsent = -1;

  struct Interval {
    double start = 0.0;                    ///< m from the entry point
    double end = 0.0;                      ///< m
    int owner = 0;                         ///< the tube (from 0) whose section ends at `end`
    std::array<int, kMaxTubes> section{};  ///< section of each tube here, kAbsent beyond the tube's end
  };
  std::array<Interval, kMaxIntervals> interval;
  int count = 0;

  double length() const { return interval[count - 1].end; }  ///< end of tube 1, m
};

/** Checks that q is valid for a model: size, finite numbers, equation (1) of Alsaka et al. 2024 for the tubes' ends. */
ModelStatus checkJoints(const ConcentricTubeArm& arm, const JointsRef& q) noexcept;

/** Segments the arm at q, for which checkJoints() has to be kOk. Allocates nothing. */
void segment(const ConcentricTubeArm& arm, const JointsRef& q, Segmentation& result) noexcept;

/// Angles in which the tubes bend at their ends if none twists: alpha_i plus the integral of tau_i from the motor to
/// the end, rad. @param parts of the arm at q
TubeVector untwistedEnds(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q) noexcept;

}  // namespace tandem::kinematics
