// SPDX-License-Identifier: Apache-2.0
/** @file Checked request of a computation, in terms of planning/. */
#pragma once

#include <optional>
#include <stdexcept>

#include "idl/messages.h"
#include "planning/inverse_kinematics.h"
#include "planning/reference_tracker.h"
#include "robots/robot_model.h"

namespace tandem::computation {

/** Why a request is not taken: the key, what was found, what was expected. */
class Refusal : public std::runtime_error {
 public:
  Refusal(msg::ReplyCode code, const std::string& reason) : std::runtime_error(reason), code_(code) {}
  msg::ReplyCode code() const { return code_; }

 private:
  msg::ReplyCode code_;
};

/** The robot that is computed for. */
struct ComputationRobot {
  const config::Robot& robot;
  const robots::RobotModel& model;
  bool rigid;               ///< arms never snap: no stability is asked for
  planning::Gains gains{};  ///< of rehearsals
  double period = 0.0;      ///< of rehearsals, s; 0: the robot file's
};

/** One request that makes sense. */
struct ComputationProblem {
  static constexpr int kMostPoints = 2000;                        ///< of a trajectory; a start is chosen by fewer
  static constexpr std::size_t kLongestTrajectory = 1024 * 1024;  ///< bytes of its text
  static constexpr int kMostTargets = safety::kMaxArms;

  /// @param robot  must outlive the problem
  /// @param present  the robot's joints, for a request without joints; nothing: they are not known
  /// @throw Refusal
  ComputationProblem(msg::ComputationRequest request,
                     const ComputationRobot& robot,
                     const std::optional<safety::RobotVector>& present);

  msg::ComputationRequest request;
  ComputationRobot robot;
  planning::Arms arms;
  safety::RobotVector start;
  planning::TrajectorySpec spec;               ///< of all kinds but inverse kinematics
  std::vector<planning::TipTarget> targets{};  ///< of inverse kinematics

 private:
  void checkNumbers() const;
  void readTargets();
  void readTrajectory();
};

}  // namespace tandem::computation
