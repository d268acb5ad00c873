// SPDX-License-Identifier: Apache-2.0
/** @file Run: interface of a motion for which planning generates one reference per control period. */
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "config/config.h"
#include "planning/follower.h"
#include "planning/tips.h"

namespace tandem::robots {

/** Measured state of a robot, as a run judges it. */
struct Measured {
  safety::RobotVector joints;                  ///< of all arms; empty: not all of them are valid
  std::array<bool, safety::kMaxArms> valid{};  ///< by arm
  /// Measured tips, where the deployment's `feedback` says that they count; null: the model's.
  const planning::MeasuredTips* tips = nullptr;
};

/** One motion after another, of the kind that the robot can follow: a trajectory of two tips, or a path of what the
 * arms move together. Not for the periodic thread: implementations allocate. */
class Run {
 public:
  virtual ~Run() = default;

  /// The joints were put elsewhere without a path.
  virtual void restart() = 0;
  /// Follows measured joints, whether a motion runs or not.
  virtual void observe(const safety::RobotVector& q) = 0;

  /// Begins a motion. @param text  YAML of a trajectory or path  @param postures  planned joints of all arms, one
  /// vector a point; empty: none. @return empty, or why it cannot start
  /// @throw std::invalid_argument, or config::Error, for a text that is none
  virtual std::string start(const std::string& text,
                            const Measured& now,
                            std::vector<safety::RobotVector> postures) = 0;
  /// Judges the measured state and says what to do next: a new reference while the motion runs; while it is paused, the
  /// last one without feed-forward. @return empty, or why the motion cannot go on
  virtual std::string update(const Measured& now, planning::Reference& reference) = 0;
  virtual void pause() = 0;
  virtual void resume() = 0;
  virtual void stop() = 0;
  virtual void fail() = 0;  ///< ends a motion that cannot go on, as kFailed

  virtual const planning::Progress& progress() const = 0;
  virtual double tolerance() const = 0;                       ///< at the end, m
  virtual std::string name() const = 0;                       ///< of the motion
  virtual std::vector<Eigen::Isometry3d> points() const = 0;  ///< of the motion, robot base frame
};

class RobotModel;

/// The run of a robot with Capability::kTips or kCommonPath. @param robot, model  outlive it
/// @param period  of control, s  @throw std::invalid_argument as makeEquilibriumFollower() does.
std::unique_ptr<Run> makeRun(const config::Robot& robot, const RobotModel& model, double period);

}  // namespace tandem::robots
