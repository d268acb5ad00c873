// SPDX-License-Identifier: Apache-2.0
/** @file Conversions between IDL messages and library structs that several processes share. Nothing here
 * allocates. */
#pragma once

#include <string_view>

#include "idl/messages.h"
#include "planning/reference.h"
#include "planning/tips.h"
#include "safety/faults.h"

namespace tandem::msg {

/// The `size` joints of one arm from those of all arms, m, rad.
safety::ArmVector jointsOf(const JointArray& joints, int arm, int size) noexcept;

/// Joints of all arms of a robot, stacked. @return false if there is no state, it is another robot's, or not all arms
/// are measured; q is unchanged then.
bool measuredJoints(const ActuationState& state, int arm_count, int joint_count, safety::RobotVector& q) noexcept;

/// Tasks of a message, at most planning::kMaxTasks.
planning::Reference tasksOf(const PlanningReference& message) noexcept;
/// Writes task_count and tasks of a message.
void setTasks(const planning::Reference& reference, PlanningReference& message) noexcept;

/// Writes the posture of a message; an empty one means none.
void setPosture(const safety::RobotVector& posture,
                int arm_count,
                const PerArm<std::uint8_t>& joint_count,
                PlanningReference& message) noexcept;
/// Posture of a message, stacked; empty if there is none or a number is NaN or infinite.
safety::RobotVector postureOf(const PlanningReference& message,
                              int arm_count,
                              const PerArm<std::uint8_t>& joint_count) noexcept;

/// Copies the measurements of a tip tracker.
void takeTips(const TipPoses& message, planning::MeasuredTips& tips) noexcept;
/// Position of an arm's tip, m, robot base frame.
Eigen::Vector3d tipPosition(const TipPoses& message, int arm) noexcept;
Eigen::Quaterniond tipOrientation(const TipPoses& message, int arm) noexcept;
void setTip(int arm,
            bool valid,
            const Eigen::Vector3d& position,
            const Eigen::Quaterniond& orientation,
            TipPoses& message) noexcept;

/// First cause of an arm's FAULT state as reported by hal or sim; empty if it is not in FAULT.
safety::FaultRecord faultRecordOf(const HalStatus& message, int arm) noexcept;
void setFaultRecord(const safety::FaultRecord& record, int arm, HalStatus& message) noexcept;

}  // namespace tandem::msg
