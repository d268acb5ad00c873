// SPDX-License-Identifier: Apache-2.0
/** @file Kind of a joint (translation or rotation), by its number. */
#pragma once

namespace tandem::safety {

/// Whether a joint of an arm is a translation, m, not a rotation, rad: the first half of a tube arm's joints, the first
/// of a catheter's three.
constexpr bool isTranslation(int joint, int joint_count) noexcept { return joint < joint_count / 2; }

}  // namespace tandem::safety
