// SPDX-License-Identifier: Apache-2.0
/** @file Run of a trajectory of one tip, or of two. */
#pragma once

#include "robots/robot_model.h"
#include "robots/run.h"

namespace tandem::robots {

/** Run with planning::Follower. Tips are measured, or those of the model, which follows every state because elastic
 * arms depend on the path of the joints. */
class TrajectoryRun final : public Run {
 public:
  TrajectoryRun(config::Robot robot, const RobotModel& model, double period)
      : robot_(std::move(robot)),
        models_(model.models()),
        limits_(model.limits()),
        tips_(models_, limits_),
        follower_(period) {}

  void restart() override { tips_.restart(); }
  void observe(const safety::RobotVector& q) override { tips_.update(q); }
  std::string start(const std::string& text, const Measured& now, std::vector<safety::RobotVector> postures) override;
  std::string update(const Measured& now, planning::Reference& reference) override;
  void pause() override { follower_.pause(); }
  void resume() override { follower_.resume(); }
  void stop() override { follower_.stop(); }
  void fail() override { follower_.fail(); }
  const planning::Progress& progress() const override { return follower_.progress(); }
  std::span<const planning::ErrorStatistics> errors() const override { return follower_.errors(); }
  double tolerance() const override { return follower_.spec().tolerance; }
  std::string name() const override { return follower_.spec().name; }
  std::vector<Eigen::Isometry3d> points() const override;

 private:
  bool known(const planning::TrajectorySpec& spec, const Measured& now) const;

  const config::Robot robot_;
  const std::vector<const kinematics::ArmModel*> models_;
  const std::vector<const safety::ArmLimits*> limits_;
  planning::TipFollower tips_;
  planning::Follower follower_;
};

}  // namespace tandem::robots
