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

/// `size` joints of one arm out of those of all, m, rad.
safety::ArmVector jointsOf(const JointArray& joints, int arm, int size) noexcept;

/// Joints of all arms of a robot, stacked. @return false where the state is none, another robot's, or not all arms are
/// measured; q then is what it was.
bool measuredJoints(const ActuationState& state, int arm_count, int joint_count, safety::RobotVector& q) noexcept;

/// The tasks of a message; counts beyond planning::kMaxTasks are cut.
planning::Reference tasksOf(const PlanningReference& message) noexcept;
/// Writes task_count and tasks of a message.
void setTasks(const planning::Reference& reference, PlanningReference& message) noexcept;

/// Writes the posture of a message; an empty one is none.
void setPosture(const safety::RobotVector& posture,
                int arm_count,
                const PerArm<std::uint8_t>& joint_count,
                PlanningReference& message) noexcept;
/// The posture of a message, stacked; empty where there is none or a number is NaN or infinite.
safety::RobotVector postureOf(const PlanningReference& message,
                              int arm_count,
                              const PerArm<std::uint8_t>& joint_count) noexcept;

/// Takes in what a tip tracker has measured.
void takeTips(const TipPoses& message, planning::MeasuredTips& tips) noexcept;
/// Position of an arm's tip, m, robot base frame.
Eigen::Vector3d tipPosition(const TipPoses& message, int arm) noexcept;
void setTip(int arm,
            bool valid,
            const Eigen::Vector3d& position,
            const Eigen::Quaterniond& orientation,
            TipPoses& message) noexcept;

/// What led an arm into FAULT, as hal or sim says; empty where it is not in FAULT.
safety::FaultRecord faultRecordOf(const HalStatus& message, int arm) noexcept;
void setFaultRecord(const safety::FaultRecord& record, int arm, HalStatus& message) noexcept;

}  // namespace tandem::msg
