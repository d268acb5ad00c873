// SPDX-License-Identifier: Apache-2.0
#include "services/planning/path_follower.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "config/path.h"
#include "planning/path_reference.h"

namespace tandem::service {
namespace {

using planning::Phase;

std::string millimetres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", 1e3 * value);
  return text;
}

}  // namespace

PathFollower::PathFollower(const Setup& setup) : setup_(setup), follower_(robots::makeRestFollower(setup.robot)) {
  options_.parameters.period = setup.deployment.control_period;
}

void PathFollower::restart() { follower_ = robots::makeRestFollower(setup_.robot); }

void PathFollower::pause() {
  if (progress_.phase == Phase::kRunning)
    progress_.phase = Phase::kPaused;
}

void PathFollower::resume() {
  if (progress_.phase == Phase::kPaused)
    progress_.phase = Phase::kRunning;
}

/// Why the rest that there is now cannot be the start of the path.
std::string PathFollower::refusal() const {
  const std::string trouble = follower_.mechanism().trouble();
  return trouble.empty() ? robots::refusal(follower_.mechanism(), path_) : trouble;
}

std::string PathFollower::start(const std::string& text, const safety::RobotVector& q) {
  planning::ObjectPath path = config::parsePath(text, "planning/request");
  path.length = follower_.mechanism().length();
  path.check();
  if (const std::string why = follower_.settle(q); !why.empty())
    return "no rest at the present joints: " + why;
  if (const std::string why = follower_.mechanism().impossible(); !why.empty())
    return why;
  path_ = path;
  const bool ready = follower_.mechanism().drift() <= robots::kPrepared * options_.most_drift;
  if (const std::string why = ready ? refusal() : ""; !why.empty())
    return why;
  part_ = Part::kBefore;
  start_ = follower_.mechanism().pose();
  periods_ = 0;
  reference_ = {};
  why_.clear();
  progress_ = {};
  progress_.phase = Phase::kRunning;
  progress_.point_count = kPoints;
  return {};
}

bool PathFollower::end(const std::string& why) {
  why_ = why;
  fail();
  return false;
}

void PathFollower::ask(const planning::FrameReference& frame) {
  reference_.task_count = 1;
  reference_.tasks[0].kind = planning::TaskKind::kFrame;
  reference_.tasks[0].position = frame.position;
  reference_.frame = frame;
  wanted_ = planning::poseOf(frame.after(options_.parameters.period));
}

/// What is wrong with the rest along the path.
std::string PathFollower::judge() const {
  const robots::Mechanism& mechanism = follower_.mechanism();
  if (std::string trouble = mechanism.trouble(); !trouble.empty())
    return trouble;
  if (mechanism.drift() > options_.most_drift)
    return "contacts drift by " + millimetres(mechanism.drift()) + ", more than " + millimetres(options_.most_drift);
  if (progress_.tip_error > options_.most_error)
    return "the path is left by " + millimetres(progress_.tip_error) + ", more than " +
           millimetres(options_.most_error);
  return {};
}

/// What is moved is held where it was at the start, until the path can begin.
bool PathFollower::before() {
  if (follower_.mechanism().drift() <= robots::kPrepared * options_.most_drift) {
    if (const std::string why = refusal(); !why.empty())
      return end(why);
    part_ = Part::kAlong;
    start_ = follower_.mechanism().pose();
    periods_ = 0;
    return along();
  }
  if (periods_++ * options_.parameters.period >= options_.patience)
    return end("before the path: " + robots::kUnprepared);
  ask(planning::heldReference(path_, start_));
  return true;
}

bool PathFollower::along() {
  const double period = options_.parameters.period, time = periods_++ * period;
  ask(planning::pathReference(path_, start_, time, period));
  progress_.iteration = periods_;
  progress_.point = 1 + static_cast<int>((kPoints - 1) * std::min(1.0, time / path_.duration));
  if (time >= path_.duration) {
    part_ = Part::kEnd;
    periods_ = 0;
  }
  return true;
}

bool PathFollower::update(const safety::RobotVector& q, planning::Reference& reference) {
  if (progress_.phase != Phase::kRunning && progress_.phase != Phase::kPaused)
    return false;
  if (const std::string why = follower_.settle(q); !why.empty())
    return end("no rest at the present joints: " + why);
  if (progress_.total_iterations > 0)
    progress_.tip_error = planning::trackedError(path_, follower_.mechanism().pose(), wanted_);
  if (const std::string why = part_ == Part::kBefore ? "" : judge(); !why.empty())
    return end("at " + std::to_string(std::max(0, progress_.iteration - 1) * options_.parameters.period).substr(0, 6) +
               " s: " + why);
  if (progress_.phase == Phase::kPaused) {
    if (progress_.total_iterations == 0)
      ask(planning::heldReference(path_, follower_.mechanism().pose()));
    reference_.frame.feed_forward.setZero();
    wanted_ = planning::poseOf(reference_.frame);
    reference = reference_;
    return true;
  }
  bool running = true;
  if (part_ == Part::kEnd) {
    reference_.frame.feed_forward.setZero();
    const bool there = progress_.tip_error <= kTolerance;
    if (there)
      progress_.phase = Phase::kFinished, progress_.converged_points = kPoints;
    else if (periods_++ * options_.parameters.period >= kPatience)
      end("the end of the path is missed by " + millimetres(progress_.tip_error) + ", more than " +
          millimetres(kTolerance));
    running = progress_.phase == Phase::kRunning;
  } else {
    running = part_ == Part::kBefore ? before() : along();
  }
  if (running) {
    ++progress_.total_iterations;
    reference = reference_;
  }
  return running;
}

std::vector<Eigen::Isometry3d> PathFollower::points() const {
  std::vector<Eigen::Isometry3d> points;
  for (int k = 0; k <= kPoints; ++k)
    points.push_back(planning::poseOf(planning::pathReference(path_, start_, k * path_.duration / kPoints, 1e-3)));
  return points;
}

}  // namespace tandem::service
