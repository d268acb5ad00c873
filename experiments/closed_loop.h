// SPDX-License-Identifier: Apache-2.0
/** @file The closed loop in one process: follower, tracker, gate and simulated joints, as the services run them in
 * lock-step. */
#pragma once

#include <functional>

#include "experiments/simulated_robot.h"
#include "planning/follower.h"

namespace tandem::experiments {

/** One run that an experiment asks for. */
struct RunPlan {
  RunKey key;
  planning::TrajectorySpec trajectory;
  std::vector<Eigen::VectorXd> start;
  std::vector<planning::TrajectoryPoint> points{};  ///< in place of those of the trajectory's shape; empty: its own
  std::vector<safety::RobotVector> postures{};      ///< planned joints of all arms, one vector a point; empty: none
};

/** A loop after one iteration. */
struct LoopView {
  const StepData& data;
  const SimulatedRobot& robot;
  const planning::Progress& progress;
  bool held;  ///< control held the setpoint: the tips were not measured, or too long ago
};

/// Options of the loop from a deployment, with the gains of the experiment.
LoopOptions loopOptions(const config::Deployment& deployment, const config::Experiment& experiment);

/// All runs of an experiment: trajectories, then methods, then configurations, in the order of the file.
/// @throw std::invalid_argument for a trajectory that names an unknown configuration.
std::vector<RunPlan> plan(const config::Experiment& experiment);

/** Removes the gate from offline runs. Its limits are those of the simulated drives, so it saturates nothing where
 * these have none; there is no switch in the gate itself, and so none that a process could set. Its integrity guards
 * stay.
 * @param[in,out] robot  the controller's: it keeps its limits, and its models accept joints outside equation (1)
 * @return the plant's, for runOffline(): the same without limits of position, velocity and rows. */
config::Robot withoutGate(config::Robot& robot);

/** Closes the loop of one plan until its run is over. @param after  called after every iteration
 * @return where the run ended
 * @throw std::invalid_argument for `feedback: sensor` without a tip tracker, std::runtime_error where model or plant
 * cannot answer or the gate refuses a command. */
planning::Progress runLoop(const config::Robot& robot,
                           const RobotModel& model,
                           const RunPlan& plan,
                           const LoopOptions& options,
                           const std::function<void(const LoopView&)>& after);

/** Runs one plan without DDS. Gives the digits of the processes in lock-step, because it calls the same objects in the
 * same order.
 * @param model  the controller's; the plant has its own
 * @param progress  called after every iteration with point and point count; may be empty.
 * @throw std::invalid_argument as runLoop() does
 * @return the rows; of a run that runLoop() could not end, those before, and why: RunSummary::failure */
RunRecord runOffline(const config::Robot& robot,
                     const RobotModel& model,
                     const RunPlan& plan,
                     const LoopOptions& options,
                     const std::function<void(int point, int points)>& progress = {});

}  // namespace tandem::experiments
