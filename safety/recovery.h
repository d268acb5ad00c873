// SPDX-License-Identifier: Apache-2.0
/** @file Recovery of an arm that cannot be enabled (outside its limits, or with lost joints): speeds, permitted
 * directions, order of withdrawal.
 *
 * It is slow; a joint that stands outside a limit, or a pair that breaks a coupled row, moves inwards alone (the gate
 * lets nothing go farther out); a lost joint stays where it is, and the rows count with it. */
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

/// How fast joint j may move while its arm is recovered, m/s or rad/s; 0 where it is lost.
double recoveryVelocity(const ArmLimits& limits, JointMask lost, int joint) noexcept;

/** What of an arm retracts next. */
struct Withdrawal {
  JointMask joints = 0;  ///< translations that go back together, by the same way; 0: nothing can be retracted
  double way = 0.0;      ///< m, above zero where there are joints
};

/** Withdrawal of concentric tubes, step by step: the innermost tube that can go back goes back alone, so the piece of
 * it that stands out of the next one slides along its own shape; where that one's end holds it, both go together, and
 * so on outwards. Rotations stay. Each step depends on nothing but where the arm stands, so it can be stopped and taken
 * up again, and it ends at the least extension of every tube that the limits allow with the lost joints where they are.
 * @param q where the arm stands, m, rad
 * @param step no joint goes farther in one go, m */
Withdrawal nextWithdrawal(const ArmLimits& limits, const ArmVector& q, JointMask lost, double step) noexcept;

}  // namespace tandem::safety
