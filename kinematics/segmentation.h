// SPDX-License-Identifier: Apache-2.0
/** @file Segmentation of an arm into intervals with constant properties, for all concentric tube models. */
#pragma once

#include <array>

#include "kinematics/tube_model.h"

namespace tandem::kinematics {

/** What joints mean along the backbone in front of the entry point, s > 0. Every tube brings a boundary where a section
 * of it ends; between two boundaries all tubes keep their curvature and stiffness. Boundaries that meet leave intervals
 * of length zero between them, which models skip; no length is rounded. */
struct Segmentation {
  static constexpr int kMaxIntervals = kMaxTubes * kMaxTubeSections;
  static constexpr int kAbsent = -1;

  struct Interval {
    double start = 0.0;                    ///< m from the entry point
    double end = 0.0;                      ///< m
    int owner = 0;                         ///< the tube (from 0) whose section ends at `end`
    std::array<int, kMaxTubes> section{};  ///< section of each tube here, kAbsent where the tube has ended
  };
  std::array<Interval, kMaxIntervals> interval;
  int count = 0;

  double length() const { return interval[count - 1].end; }  ///< end of tube 1, m
};

/** Whether a model can answer for q: size, finite numbers, equation (1) of Alsaka et al. 2024 as far as the tubes'
 * ends go. */
ModelStatus checkJoints(const ConcentricTubeArm& arm, const JointsRef& q) noexcept;

/** Cuts the arm at q, for which checkJoints() has to be kOk. Allocates nothing. */
void segment(const ConcentricTubeArm& arm, const JointsRef& q, Segmentation& result) noexcept;

}  // namespace tandem::kinematics
