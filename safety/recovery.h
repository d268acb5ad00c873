// SPDX-License-Identifier: Apache-2.0
/** @file Recovery of an arm that cannot be enabled (outside its limits, or with lost joints): speeds, permitted
 * directions, order of withdrawal.
 *
 * Motion is slow. A joint outside a limit, or a pair that violates a coupled row, moves inwards only (the gate permits
 * no motion farther out). A lost joint stays where it is, and the rows include its position. */
#pragma once

#include <cstdint>

#include "safety/limits.h"

namespace tandem::safety {

/// Largest speeds while an arm is recovered, m/s and rad/s.
inline constexpr double kRecoveryTranslation = 2e-3;
inline constexpr double kRecoveryRotation = 0.1;

/// Joints of an arm, bit j for joint j.
using JointMask = std::uint8_t;
constexpr JointMask jointBit(int joint) { return static_cast<JointMask>(1u << joint); }

/// Largest speed of joint j while its arm is recovered, m/s or rad/s; 0 if the joint is lost.
double recoveryVelocity(const ArmLimits& limits, JointMask lost, int joint) noexcept;

/** One step of a withdrawal. */
struct Withdrawal {
  JointMask joints = 0;   ///< translations that retract together, by the same distance; 0: nothing can be retracted
  double distance = 0.0;  ///< distance, m, above zero if there are joints
};

/** Withdrawal of concentric tubes, step by step: the innermost tube that can retract retracts alone, so the part of it
 * that extends from the next tube slides along its own shape; if the end of the next tube blocks it, both retract
 * together, and so on outwards. Rotations keep their position. Each step depends only on the present joints, so the
 * withdrawal can be stopped and resumed. It ends at the least extension of every tube that the limits allow with the
 * lost joints where they are.
 * @param q present joints, m, rad
 * @param step largest distance of one step, m */
Withdrawal nextWithdrawal(const ArmLimits& limits, const ArmVector& q, JointMask lost, double step) noexcept;

}  // namespace tandem::safety
