// SPDX-License-Identifier: Apache-2.0
/** @file Run: interface of a motion for which planning generates one reference per control period. */
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "config/config.h"
#include "planning/follower.h"
#include "planning/tips.h"

namespace tandem::robots {

/** Measured state of a robot, as input of a run. */
struct Measured {
  safety::RobotVector joints;                  ///< of all arms; empty: not all are valid
  std::array<bool, safety::kMaxArms> valid{};  ///< by arm
  /// Measured tips, if the deployment's `feedback` selects them; null: use the model's.
  const planning::MeasuredTips* tips = nullptr;
};

/** Execution of motions, one after another, of the type that the robot can follow: a trajectory of two tips, or a path
 * of the common object. Not for the periodic thread: implementations allocate. */
class Run {
 public:
  virtual ~Run() = default;

  /// The joints were reset without a motion.
  virtual void restart() = 0;
  /// Follows measured joints, with or without a running motion.
  virtual void observe(const safety::RobotVector& q) = 0;

  /// Starts a motion. @param text  YAML of a trajectory or path  @param postures  planned joints of all arms, one
  /// vector per point; empty: none. @return empty, or why it cannot start
  /// @throw std::invalid_argument, or config::Error, for an invalid text
  virtual std::string start(const std::string& text,
                            const Measured& now,
                            std::vector<safety::RobotVector> postures) = 0;
  /// Checks the measured state and writes the reference: a new one while the motion runs; while it is paused, the last
  /// one without feed-forward. @return empty, or why the motion cannot continue
  virtual std::string update(const Measured& now, planning::Reference& reference) = 0;
  virtual void pause() = 0;
  virtual void resume() = 0;
  virtual void stop() = 0;
  virtual void fail() = 0;  ///< ends a motion that cannot continue, as kFailed

  virtual const planning::Progress& progress() const = 0;
  /// Errors of each task of the reference, in their order.
  virtual std::span<const planning::ErrorStatistics> errors() const = 0;
  virtual double tolerance() const = 0;                       ///< at the end, m
  virtual std::string name() const = 0;                       ///< of the motion
  virtual std::vector<Eigen::Isometry3d> points() const = 0;  ///< of the motion, robot base frame
};

class RobotModel;

/// The run of a robot with Capability::kTips or kCommonPath. @param robot, model  outlive it
/// @param period  of control, s  @throw std::invalid_argument as makeEquilibriumFollower() does.
std::unique_ptr<Run> makeRun(const config::Robot& robot, const RobotModel& model, double period);

}  // namespace tandem::robots
