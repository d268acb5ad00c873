// SPDX-License-Identifier: Apache-2.0
/** @file Path follower for arms that move one thing together: selects the reference for each measured state. */
#pragma once

#include <string>

#include "planning/follower.h"
#include "robots/mechanisms.h"
#include "robots/track.h"
#include "services/runtime/process.h"

namespace tandem::service {

/** Walks along a path by time, one update per control period.
 *
 * First what is moved is held where it is, until what comes before the motion is so: forces that the arms shall hold
 * it with (robots::prepare()); Progress::point is 0 as long. Then the path, of which the points are hundredths of
 * its time, in Progress::iteration its periods. A run is finished when its end is reached within the tolerance, failed
 * when it is not after some patience; and as soon as there is something wrong with the rest, or it is off by more than
 * a run may be (robots::TrackOptions). Not for the periodic thread: it settles and allocates. */
class PathFollower {
 public:
  static constexpr int kPoints = 100;
  static constexpr double kTolerance = 1e-4;  ///< m, radians counting as in robots/track.h
  static constexpr double kPatience = 2.0;    ///< s, to reach the end

  /// @throw std::invalid_argument as robots::makeRestFollower() does.
  explicit PathFollower(const Setup& setup);

  /// Starts at measured joints. @return empty, or why not: that could be seen before anything moves
  /// @throw std::invalid_argument for a path that is none; config::Error likewise for a text that is none.
  std::string start(const std::string& text, const safety::RobotVector& q);
  void stop() { progress_.phase = planning::Phase::kIdle; }
  void fail() { progress_.phase = planning::Phase::kFailed; }
  void pause();
  void resume();
  /// The joints were put elsewhere without a path.
  void restart();

  /// Judges measured joints and says what to do next. @return true with a new reference while running; while paused
  /// the last one is held without feed-forward. Otherwise why() may say why the run is over.
  bool update(const safety::RobotVector& q, planning::Reference& reference);
  const std::string& why() const { return why_; }

  const planning::Progress& progress() const { return progress_; }
  const planning::ObjectPath& path() const { return path_; }
  /// Points of the path from where what is moved is now.
  std::vector<Eigen::Isometry3d> points() const;

 private:
  enum class Part { kBefore, kAlong, kEnd };

  bool end(const std::string& why);
  std::string judge() const;
  bool before();
  bool along();
  void ask(const planning::FrameReference& frame);
  std::string refusal() const;

  const Setup& setup_;
  robots::RestFollower follower_;
  robots::TrackOptions options_;
  planning::ObjectPath path_;
  Part part_ = Part::kBefore;
  Eigen::Isometry3d start_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d wanted_ = Eigen::Isometry3d::Identity();  ///< a period after the last reference
  int periods_ = 0;                                           ///< of this part
  planning::Reference reference_;
  planning::Progress progress_;
  std::string why_;
};

}  // namespace tandem::service
