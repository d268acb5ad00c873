// SPDX-License-Identifier: Apache-2.0
/** @file Reachable space of the target arm, alone and with an assist arm. */
#pragma once

#include <cstdint>
#include <span>

#include "kinematics/assist/target_assist.h"

namespace tandem::kinematics::assist {

/// Joints from `lower` to `upper`, m and rad.
struct Range {
  Joints lower = Joints::Zero(), upper = Joints::Zero();
};

/** How far a place is from all that the target's tip reaches without contact, m; 0 where it reaches, to 1e-9 m. The
 * roll is taken as free: with less than a turn of it the true distance can only be larger.
 * @param place  robot base frame */
double distanceBeyondReach(const catheter::Arm& target, const Range& range, const Eigen::Vector3d& place);

/// Joints number `index` of a sequence that fills a range evenly (Roberts 2018, shifted by a seed).
Joints jointsOf(const Range& range, std::uint64_t index, std::uint64_t seed);

/** What assistance does at one joint vector. */
struct Reach {
  Status status = Status::kNotConverged;
  Eigen::Vector3d assisted = Eigen::Vector3d::Zero();  ///< tip, m, robot base frame; where the status is kOk
  double beyond = 0.0;                                 ///< of it, see distanceBeyondReach(), m
};
Reach reachAt(const TargetAssist& model, const Range& range, const Joints& q);

/** Volumes by counting cells, m^3. */
struct ReachVolume {
  double alone = 0.0;     ///< cells whose centre the target reaches alone
  double assisted = 0.0;  ///< cells with an assisted tip in them
  double gained = 0.0;    ///< those of them that lie beyond the target's own reach as a whole
  double farthest = 0.0;  ///< how far an assisted tip is beyond, m
  int answered = 0;       ///< samples with a contact
  int samples = 0;
};

/// Of samples that reachAt() has answered. @param cell  edge of a cell, m
ReachVolume reachVolume(const catheter::Arm& target, const Range& range, std::span<const Reach> samples, double cell);

/// @param samples  joint vectors that are tried, cold  @param cell  edge of a cell, m
ReachVolume reachVolume(const TargetAssist& model, const Range& range, int samples, double cell, std::uint64_t seed);

}  // namespace tandem::kinematics::assist
