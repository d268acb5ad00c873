// SPDX-License-Identifier: Apache-2.0
/** @file What planning computes for clients: one request, checked, run, answered. No DDS, no threads. */
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>

#include "experiments/run_record.h"
#include "planning/rehearsal.h"
#include "planning/start_choice.h"
#include "services/dds/messages.h"

namespace tandem::service {

/** Why a request is not taken: the key, what was found, what was expected. */
class Refusal : public std::runtime_error {
 public:
  Refusal(dds::ReplyCode code, const std::string& reason) : std::runtime_error(reason), code_(code) {}
  dds::ReplyCode code() const { return code_; }

 private:
  dds::ReplyCode code_;
};

/** How a computation is watched. Both are called often, on the thread that computes; empty ones are not. */
struct ComputationHooks {
  std::function<bool()> cancelled;
  /// `at` is what is counted: "point", "start", "round 2, point", "timing".
  std::function<void(double fraction, const std::string& at, int done, int all)> progress;
};

/** The robot that is computed for. */
struct ComputationRobot {
  const config::Robot& robot;
  const experiments::RobotModel& model;
  bool rigid;               ///< arms never snap: no stability is asked for
  planning::Gains gains{};  ///< of rehearsals
  double period = 0.0;      ///< of rehearsals, s; 0: the robot file's
};

/** One computation, ready to run. The same request gives the same answer, whichever process computes it. */
class Computation {
 public:
  static constexpr int kMostPoints = 2000;  ///< of a trajectory; a start is chosen by fewer
  static constexpr int kMostTargets = safety::kMaxArms;

  /// @param robot  must outlive the computation
  /// @param present  the robot's joints, for a request without joints; nothing: they are not known
  /// @throw Refusal
  Computation(dds::ComputationRequest request,
              const ComputationRobot& robot,
              const std::optional<safety::RobotVector>& present);

  const dds::ComputationRequest& request() const { return request_; }
  /// s
  double timeLimit() const { return request_.time_limit > 0.0 ? request_.time_limit : 600.0; }

  /// Never throws; whoever cancels fills in cancelled_by, reason and elapsed.
  dds::ComputationResult run(const ComputationHooks& hooks) const noexcept;

 private:
  void checkNumbers() const;
  void readTargets();
  void readTrajectory();
  planning::IkOptions ik(const ComputationHooks& hooks) const;
  planning::FeasibilityOptions feasibility(const ComputationHooks& hooks, double share) const;
  void check(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void repair(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void inverse(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void time(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void chooseStart(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  planning::Rehearsal rehearsed(const ComputationHooks& hooks,
                                const std::vector<safety::RobotVector>& postures,
                                const char* at) const;
  planning::FeasibilityReport checked(const ComputationHooks& hooks,
                                      double share,
                                      dds::ComputationResult& result) const;

  dds::ComputationRequest request_;
  ComputationRobot robot_;
  planning::Arms arms_;
  safety::RobotVector start_;
  planning::TrajectorySpec spec_;
  std::vector<planning::TipTarget> targets_;
};

}  // namespace tandem::service
