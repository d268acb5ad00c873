// SPDX-License-Identifier: Apache-2.0
/** @file Validation of computation requests, and their conversion to the types of planning/. */
#pragma once

#include <optional>
#include <stdexcept>

#include "idl/messages.h"
#include "planning/inverse_kinematics.h"
#include "planning/method_settings.h"
#include "robots/robot_model.h"

namespace tandem::computation {

/** A request is refused; what() has key, found and expected value. */
class Refusal : public std::runtime_error {
 public:
  Refusal(msg::ReplyCode code, const std::string& reason) : std::runtime_error(reason), code_(code) {}
  msg::ReplyCode code() const { return code_; }

 private:
  msg::ReplyCode code_;
};

/** Robot of a computation. */
struct ComputationRobot {
  const config::Robot& robot;
  const robots::RobotModel& model;
  bool rigid;               ///< arms never snap: no stability margin is required
  planning::Gains gains{};  ///< of rehearsals, unless the request has others
  double period = 0.0;      ///< of rehearsals, s; 0: the robot file's
};

/** One validated request. */
struct ComputationProblem {
  static constexpr int kMostPoints = 2000;                        ///< of a trajectory, except for the choice of a start
  static constexpr std::size_t kLongestTrajectory = 1024 * 1024;  ///< bytes of its text
  static constexpr int kMostTargets = safety::kMaxArms;

  /// @param robot  must outlive the problem
  /// @param present  the robot's joints, for a request without joints; empty: unknown
  /// @throw Refusal
  ComputationProblem(msg::ComputationRequest request,
                     const ComputationRobot& robot,
                     const std::optional<safety::RobotVector>& present);

  msg::ComputationRequest request;
  ComputationRobot robot;
  planning::Arms arms;
  safety::RobotVector start;
  planning::TrajectorySpec spec;               ///< all kinds except inverse kinematics
  std::vector<planning::TipTarget> targets{};  ///< of inverse kinematics
  planning::MethodSettings rehearsal{};        ///< of a check that rehearses

 private:
  void checkNumbers() const;
  void readRehearsal();
  void readTargets();
  void readTrajectory();
};

}  // namespace tandem::computation
