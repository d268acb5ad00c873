// SPDX-License-Identifier: Apache-2.0
#include "experiments/simulated_robot.h"

#include <cmath>
#include <stdexcept>

#include "config/arm_names.h"
#include "robots/plant/plant.h"

namespace tandem::experiments {
namespace {

sim::SimulatedDrives makeDrives(const config::Robot& robot,
                                const std::vector<Eigen::VectorXd>& start,
                                const LoopOptions& loop) {
  std::vector<safety::ArmLimits> limits;
  for (const config::Arm& arm : robot.arms)
    limits.push_back(arm.limits);
  sim::SimulatedDrivesOptions options;
  options.control_period = loop.control_period;
  options.lock_step = true;
  options.mechanics = loop.plant.mechanics;
  options.encoders = loop.plant.encoders;
  options.seed = loop.plant.seed;
  return {limits, {start.begin(), start.end()}, options};
}

}  // namespace

SimulatedRobot::SimulatedRobot(const config::Robot& robot,
                               const RobotModel& model,
                               const std::vector<Eigen::VectorXd>& start,
                               const LoopOptions& options)
    : model_(model),
      names_(config::armList(robot)),
      period_(options.control_period),
      drives_(makeDrives(robot, start, options)),
      tips_(robots::makePlantTips(robot, options.plant)) {
  sim::Command enable = next();
  enable.request.fill(safety::DriveRequest::kEnable);
  send(enable);
  for (int k = 0; k < model_.armCount(); ++k) {
    if (drives_.state(k) != safety::OperatingState::kEnabled)
      throw std::runtime_error(
          names_[static_cast<std::size_t>(k)] +
          ": the simulated arm does not enable at the start joints; check that they are inside its limits");
  }
  updateTips();
  measured_.orientations = options.orientation_feedback;
  if (options.plant.tracker.present) {
    tracker_.emplace(model_.armCount(), options.plant.tracker, options.plant.seed);
    tracker_->restart(tips_, time_, drives_.answersCommand());
    listen();
  }
}

template <class OfArm>
safety::RobotVector SimulatedRobot::stacked(OfArm of_arm) const {
  safety::RobotVector q(model_.jointCount());
  for (int k = 0; k < model_.armCount(); ++k)
    q.segment(model_.offset(k), model_.size(k)) = of_arm(k);
  return q;
}

safety::RobotVector SimulatedRobot::position() const {
  return stacked([this](int k) { return drives_.position(k); });
}

safety::RobotVector SimulatedRobot::setpoint() const {
  return stacked([this](int k) { return drives_.setpoint(k); });
}

std::uint64_t SimulatedRobot::gateActions() const {
  std::uint64_t sum = 0;
  for (int g = 0; g < safety::kGuardCount; ++g)
    sum += drives_.guards()[static_cast<safety::Guard>(g)].count;
  return sum;
}

void SimulatedRobot::move(const safety::RobotVector& velocity, bool moving) {
  sim::Command command = next();
  for (int k = 0; k < model_.armCount(); ++k) {
    command.moving[static_cast<std::size_t>(k)] = moving;
    for (int j = 0; j < model_.size(k); ++j) {
      const auto i = static_cast<std::size_t>(k) * safety::kMaxJointsPerArm + static_cast<std::size_t>(j);
      command.velocity[i] = moving ? velocity[model_.offset(k) + j] : 0.0;
      command.position[i] = drives_.setpoint(k)[j] + period_ * command.velocity[i];
    }
  }
  send(command);
  time_ += static_cast<std::int64_t>(std::llround(1e9 * period_));
  drives_.advance(time_);
  updateTips();
  if (tracker_) {
    tracker_->step(tips_, time_, drives_.answersCommand());
    listen();
  }
}

void SimulatedRobot::updateTips() {
  for (int k = 0; k < model_.armCount(); ++k) {
    tips_.update(k, drives_.plant(k).tubes());
    if (!tips_.valid(k))
      throw std::runtime_error(
          names_[static_cast<std::size_t>(k)] +
          ": the simulated arm has no solution at these joints: " + std::string(kinematics::describe(tips_.status(k))));
  }
}

void SimulatedRobot::listen() {
  const sim::TipMeasurement& latest = tracker_->latest();
  for (int k = 0; k < model_.armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    measured_.take(k, latest.valid[i], latest.position[i], latest.orientation[i], latest.stamp, latest.mark);
  }
}

sim::Command SimulatedRobot::next() {
  sim::Command command;
  command.header = {1, ++sequence_, 0.0, model_.armCount()};
  return command;
}

void SimulatedRobot::send(const sim::Command& command) {
  if (!drives_.command(command, time_))
    throw std::runtime_error("the gate refused command " + std::to_string(command.header.sequence) +
                             " of the experiment: it is not finite or out of sequence");
}

}  // namespace tandem::experiments
