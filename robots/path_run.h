// SPDX-License-Identifier: Apache-2.0
/** @file Run along a path of what the arms move together. */
#pragma once

#include "robots/mechanisms.h"
#include "robots/run.h"
#include "robots/track.h"

namespace tandem::robots {

/** Walks along a path by time, one update per control period.
 *
 * First what is moved is held where it is, until what comes before the motion is so: forces that the arms shall hold
 * it with (prepare()); Progress::point is 0 as long. Then the path, of which the points are hundredths of
 * its time, in Progress::iteration its periods. A run is finished when its end is reached within the tolerance, failed
 * when it is not after some patience; and as soon as there is something wrong with the rest, or it is off by more than
 * a run may be (TrackOptions). */
class PathRun final : public Run {
 public:
  static constexpr int kPoints = 100;
  static constexpr double kTolerance = 1e-4;  ///< m, radians counting as in track.h
  static constexpr double kPatience = 2.0;    ///< s, to reach the end

  /// @throw std::invalid_argument as makeRestFollower() does. @param robot  outlives it
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
  double tolerance() const override { return kTolerance; }
  std::string name() const override { return path_.name; }
  std::vector<Eigen::Isometry3d> points() const override;

 private:
  enum class Part { kBefore, kAlong, kEnd };

  std::string goOn(const RobotVector& q);
  std::string next();
  std::string judge() const;
  std::string before();
  std::string along();
  std::string atEnd();
  void ask(const planning::FrameReference& frame);
  std::string refusalHere() const;

  const config::Robot& robot_;
  RestFollower follower_;
  TrackOptions options_;
  planning::ObjectPath path_;
  Part part_ = Part::kBefore;
  Eigen::Isometry3d start_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d wanted_ = Eigen::Isometry3d::Identity();  ///< a period after the last reference
  int periods_ = 0;                                           ///< of this part
  planning::Reference reference_;
  planning::Progress progress_;
};

}  // namespace tandem::robots
