// SPDX-License-Identifier: Apache-2.0
/** @file Run of the common object along a path. */
#pragma once

#include "robots/mechanisms.h"
#include "robots/run.h"
#include "robots/track.h"

namespace tandem::robots {

/** Follows a path by time, one update per control period.
 *
 * The object first stays where it is until the contact forces have their specified values; Progress::point is 0
 * meanwhile. Then it follows the path: Progress::point counts hundredths of the duration, Progress::iteration periods.
 * The run is finished when it reaches the end within the tolerance. It fails when it does not do so in time, when the
 * equilibrium cannot be used (Mechanism::error()), or when an error exceeds its limit (TrackOptions). */
class PathRun final : public Run {
 public:
  static constexpr int kPoints = 100;
  static constexpr double kTolerance = 1e-4;  ///< m; radians are weighted as in track.h
  static constexpr double kTimeout = 2.0;     ///< s, to reach the end

  /// @throw std::invalid_argument as makeEquilibriumFollower() does. @param robot  outlives it
  PathRun(const config::Robot& robot, double period);

  void restart() override;
  void observe(const RobotVector&) override {}
  std::string start(const std::string& text, const Measured& now, std::vector<RobotVector> postures) override;
  std::string update(const Measured& now, planning::Reference& reference) override;
  void pause() override;
  void resume() override;
  void stop() override { progress_.phase = planning::Phase::kIdle; }
  void fail() override { progress_.phase = planning::Phase::kFailed; }
  const planning::Progress& progress() const override { return progress_; }
  std::span<const planning::ErrorStatistics> errors() const override { return {&errors_, 1}; }
  double tolerance() const override { return kTolerance; }
  std::string name() const override { return path_.name; }
  std::vector<Eigen::Isometry3d> points() const override;

 private:
  enum class Part { kBefore, kAlong, kEnd };

  std::string step(const RobotVector& q);
  std::string next();
  std::string judge() const;
  std::string before();
  std::string along();
  std::string atEnd();
  void ask(const planning::ObjectReference& object);
  std::string refusalAtPresentPose() const;

  const config::Robot& robot_;
  EquilibriumFollower follower_;
  TrackOptions options_;
  planning::ObjectPath path_;
  Part part_ = Part::kBefore;
  Eigen::Isometry3d start_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d wanted_ = Eigen::Isometry3d::Identity();  ///< a period after the last reference
  int periods_ = 0;                                           ///< of this part
  planning::Reference reference_;
  planning::Progress progress_;
  planning::ErrorStatistics errors_;  ///< along the path, in each period
};

}  // namespace tandem::robots
