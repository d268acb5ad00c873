// SPDX-License-Identifier: Apache-2.0
/** @file Joint limits of one arm: a box per joint and linear rows A q <= b that couple joints. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "safety/dimensions.h"

namespace tandem::safety {

inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// Position tolerance, m or rad: a joint within it is at its goal, or inside its limits. Drives stop within a few
/// counts.
inline constexpr double kPositionTolerance = 1e-4;

/// Measured speed, as a multiple of the largest speed, above which a joint has run away: a position loop that catches
/// up needs less.
inline constexpr double kOverspeedFactor = 1.5;

/** Type of motion of a joint. */
enum class JointKind : std::uint8_t { kTranslation, kRotation };
using JointKinds = std::array<JointKind, kMaxJointsPerArm>;

/** Kind and limits of one joint. SI: m and m/s for translations, rad and rad/s for rotations; kUnlimited = none. */
struct JointLimit {
  double lower = -kUnlimited;                 ///< smallest position
  double upper = kUnlimited;                  ///< largest position
  double velocity = kUnlimited;               ///< largest speed
  double approach_acceleration = kUnlimited;  ///< A_max of Alsaka et al. 2024, (7): shapes the approach to a limit
  double slew_limit = kUnlimited;         ///< largest change of the commanded velocity per second, enforced by the gate
  double stop_deceleration = kUnlimited;  ///< deceleration of the stop ramp
  double max_step = kUnlimited;           ///< a setpoint farther than this from the last one is an integrity fault
  JointKind kind = JointKind::kTranslation;
  double reading_error = 0.0;  ///< largest difference between reading and joint: resolution and noise of its encoder
};

/** Origin of a linear row; it decides the name of the row in messages. */
enum class RowKind {
  kCarriageSpacing,   ///< beta_{i-1} - beta_i <= -spacing: carriages in order (Alsaka 2024, (1), proximal side)
  kMinimumExtension,  ///< beta_i + l_i + extension <= beta_{i-1} + l_{i-1}: inner tube ends ahead of the outer one
                      ///< ((1), distal side)
};

/** One row a^T q <= b over the joints of one arm. */
struct LinearRow {
  ArmVector a;     ///< coefficients, one per joint of the arm
  double b = 0.0;  ///< bound, m
  RowKind kind = RowKind::kCarriageSpacing;
  int inner_joint = 0;                        ///< joint index of tube i-1
  int outer_joint = 0;                        ///< joint index of tube i
  double approach_acceleration = kUnlimited;  ///< as JointLimit::approach_acceleration, for the gap b - a^T q
};

/** All limits of one arm. Read-only after configuration. */
struct ArmLimits {
  std::vector<JointLimit> joints;
  std::vector<LinearRow> rows;

  int jointCount() const { return static_cast<int>(joints.size()); }
  bool isTranslation(int joint) const noexcept {
    return joints[static_cast<std::size_t>(joint)].kind == JointKind::kTranslation;
  }
};

/** a^T q, summed in the order of the joints: rounding is the same wherever a row is evaluated, and it is monotone in
 * every joint. m. */
double rowValue(const LinearRow& row, const Eigen::Ref<const Eigen::VectorXd>& q) noexcept;

/** Largest amount by which q leaves the boxes and rows, in m or rad; negative or zero inside. */
double largestViolation(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q);

/** The joint that leaves the limits farthest. */
struct LimitViolation {
  int joint = 0;        ///< a row counts for its outer joint
  double amount = 0.0;  ///< m or rad; negative or zero inside
};
/// "beta_3 is 1.23 mm", to be followed by "outside". @param joint  name of the joint that is outside
std::string describe(const LimitViolation& outside, const ArmLimits& limits, const std::string& joint);

LimitViolation worstLimitViolation(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q) noexcept;

/** The joint with the reading farthest outside its limits, of those more than kPositionTolerance and
 * JointLimit::reading_error outside; amount 0: none. A reading that is not a number is outside. */
LimitViolation readOutside(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q) noexcept;

/** Joints inside boxes and rows near q, which is slightly outside: each joint moves into its box, then the outer joint
 * of each row into the row, or the inner one if the box of the outer one does not allow it. Returns q itself if it is
 * inside. */
ArmVector broughtInside(const ArmLimits& limits, const ArmVector& q) noexcept;

/** Permitted positions of a joint. */
struct Interval {
  double lower;
  double upper;
};

/** "tube 2 against tube 1 (carriage spacing)". */
std::string describe(const LinearRow& row);

/** Parameters of the limits of a concentric tube arm. All lengths in m, index 0 = tube 1, the innermost and longest. */
struct TubeLimitSpec {
  std::vector<double> tube_length;        ///< l_i, straight plus curved
  std::vector<double> carriage_spacing;   ///< n-1 margins of the proximal rows (Fig. 2's "spacing between the motors")
  std::vector<double> minimum_extension;  ///< n-1 margins of the distal rows (Fig. 2's "minimum segment length")
  std::vector<double> stage_minimum;      ///< per tube: smallest beta that the linear stage reaches, at least -l_i
  std::vector<double> stage_maximum;      ///< per tube: largest beta, at most 0
  JointLimit translation;                 ///< velocity, accelerations, max_step of every translation (box ignored)
  JointLimit rotation;                    ///< box, velocity, accelerations, max_step of every rotation
};

/** Limits for q = [beta_1..beta_n, alpha_1..alpha_n]: equation (1) of Alsaka et al. 2024 as boxes and coupled rows,
 * with margins.
 * @throw std::invalid_argument if sizes differ or the limits leave no room. */
ArmLimits makeTubeLimits(const TubeLimitSpec& spec);

}  // namespace tandem::safety
