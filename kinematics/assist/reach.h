// SPDX-License-Identifier: Apache-2.0
/** @file Reachable space of the target arm, alone and with an assist arm. */
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "kinematics/assist/target_assist.h"

namespace tandem::kinematics::assist {

/// Joints from `lower` to `upper`, m and rad.
struct Range {
  Joints lower = Joints::Zero(), upper = Joints::Zero();
};

/** Distance of a position from the reachable space of the target's tip without contact, m; 0 inside, to 1e-9 m. The
 * roll is taken as free: with a range of less than one turn the true distance can only be larger.
 * @param place  robot base frame */
double distanceBeyondReach(const catheter::Arm& target, const Range& range, const Eigen::Vector3d& place);

/// Joints number `index` of a sequence that fills a range evenly (Roberts 2018, shifted by a seed).
Joints jointsOf(const Range& range, std::uint64_t index, std::uint64_t seed);

/** Effect of assistance at one joint vector; numbers only where the status is kOk. */
struct Reach {
  Status status = Status::kNotConverged;
  Eigen::Vector3d assisted = Eigen::Vector3d::Zero();  ///< tip, m, robot base frame
  double beyond = 0.0;                                 ///< of it, see distanceBeyondReach(), m
  double force = 0.0;                                  ///< between the arms, N
  double strain = 0.0;                                 ///< largest bending strain of both arms, see largestStrain()
  double advance = 0.0;                                ///< least, of the tip too, see leastAdvance(), m
};
Reach reachAt(const TargetAssist& model, const Range& range, const Joints& q);

/** Conditions for a reached position: within both bounds, and no part of an arm behind its entry plane. */
struct ReachBounds {
  double force = std::numeric_limits<double>::infinity();   ///< N
  double strain = std::numeric_limits<double>::infinity();  ///< relative
};

/// Why a sample does not count; empty: it does.
std::string_view exclusionOf(const Reach& reach, const ReachBounds& bounds);

/** Volumes by counting cells, m^3. */
struct ReachVolume {
  double assisted = 0.0;  ///< cells with an assisted tip in them
  double gained = 0.0;    ///< those of them that lie beyond the target's own reach as a whole
  double farthest = 0.0;  ///< how far an assisted tip is beyond, m
  int counted = 0;        ///< samples within the bounds
};

/// Volume of samples from reachAt(). @param cell  edge of a cell, m
ReachVolume reachVolume(const catheter::Arm& target,
                        const Range& range,
                        std::span<const Reach> samples,
                        const ReachBounds& bounds,
                        double cell);

/// Volume that the target reaches alone, m^3: a solid of revolution, counted in cells of its meridian.
double volumeAlone(const catheter::Arm& target, const Range& range, double cell);

}  // namespace tandem::kinematics::assist
