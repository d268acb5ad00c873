// SPDX-License-Identifier: Apache-2.0
/** @file Which messages are malformed: counts beyond capacity, indices beyond arrays, texts and lists beyond reason.
 *
 * Checked before a message is written and after it is read, so that no consumer has to. Values (finite, fresh, in
 * sequence, inside limits) are the consumers' concern.
 */
#pragma once

#include <cstddef>

#include "services/dds/messages.h"

namespace tandem::dds {

inline constexpr std::size_t kMaxText = 64 * 1024;           ///< bytes of any text but the next
inline constexpr std::size_t kMaxTrajectory = 1024 * 1024;   ///< bytes of a trajectory as YAML text
inline constexpr std::size_t kMaxList = 64 * 1024;           ///< elements of any list
inline constexpr std::size_t kMaxPayload = 4 * 1024 * 1024;  ///< bytes of an encoded sample

/// What is wrong with a message, or nullptr if nothing is.
const char* malformed(const ActuationState& message);
const char* malformed(const ActuationCommand& message);
const char* malformed(const ActuationLimits& message);
const char* malformed(const PlanningReference& message);
const char* malformed(const PlanningRequest& message);
const char* malformed(const ComputationRequest& message);
const char* malformed(const ComputationProgress& message);
const char* malformed(const ComputationResult& message);
const char* malformed(const Reply& message);
const char* malformed(const TipPoses& message);
const char* malformed(const ControlStatus& message);
const char* malformed(const Clearances& message);
const char* malformed(const ControlRequest& message);
const char* malformed(const Stop& message);
const char* malformed(const SimRequest& message);
const char* malformed(const HalStatus& message);
const char* malformed(const HalRequest& message);
const char* malformed(const ClockRequest& message);
const char* malformed(const ClockReply& message);
const char* malformed(const TeleopInput& message);
const char* malformed(const TeleopStatus& message);
const char* malformed(const CrtkStatus& message);
const char* malformed(const Shape& message);
const char* malformed(const JointState& message);
const char* malformed(const PoseStamped& message);
const char* malformed(const TwistStamped& message);
const char* malformed(const Empty& message);
const char* malformed(const Bool& message);
const char* malformed(const Path& message);
const char* malformed(const OperatingState& message);
const char* malformed(const StringStamped& message);
const char* malformed(const DiagnosticArray& message);
const char* malformed(const Log& message);
const char* malformed(const MarkerArray& message);

}  // namespace tandem::dds
