// SPDX-License-Identifier: Apache-2.0
#include "robots/detail/path_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "config/path.h"
#include "planning/path_reference.h"

namespace tandem::robots {
namespace {

using planning::Phase;

std::string millimetres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", 1e3 * value);
  return text;
}

}  // namespace

PathRun::PathRun(const config::Robot& robot, double period) : robot_(robot), follower_(makeEquilibriumFollower(robot)) {
  options_.parameters.period = period;
}

void PathRun::restart() { follower_ = makeEquilibriumFollower(robot_); }

void PathRun::pause() {
  if (progress_.phase == Phase::kRunning)
    progress_.phase = Phase::kPaused;
}

void PathRun::resume() {
  if (progress_.phase == Phase::kPaused)
    progress_.phase = Phase::kRunning;
}

/// Reason why the path cannot start at the present equilibrium.
std::string PathRun::refusalAtPresentPose() const {
  const std::string error = follower_.mechanism().error();
  return error.empty() ? refusal(follower_.mechanism(), path_) : error;
}

std::string PathRun::start(const std::string& text, const Measured& now, std::vector<RobotVector>) {
  planning::ObjectPath path = config::parsePath(text, "planning/request");
  path.length = follower_.mechanism().length();
  path.check();
  if (now.joints.size() == 0)
    return "no valid actuation/state received yet; check that tandem-sim or tandem-hal is running";
  if (const std::string why = follower_.solveEquilibrium(now.joints); !why.empty())
    return "no equilibrium at the present joints: " + why;
  if (const std::string why = follower_.mechanism().infeasibility(); !why.empty())
    return why;
  path_ = path;
  const bool ready = follower_.mechanism().residual() <= kPrepared * options_.residual_limit;
  if (const std::string why = ready ? refusalAtPresentPose() : ""; !why.empty())
    return why;
  part_ = Part::kBefore;
  start_ = follower_.mechanism().pose();
  periods_ = 0;
  reference_ = {};
  progress_ = {};
  errors_ = {};
  progress_.phase = Phase::kRunning;
  progress_.point_count = kPoints;
  return {};
}

void PathRun::ask(const planning::ObjectReference& object) {
  reference_.task_count = 1;
  reference_.tasks[0].kind = planning::TaskKind::kObjectPose;
  reference_.tasks[0].position = object.position;
  reference_.object = object;
  wanted_ = planning::poseOf(object.after(options_.parameters.period));
}

/// Reason why the run cannot continue from the present equilibrium.
std::string PathRun::judge() const {
  const Mechanism& mechanism = follower_.mechanism();
  std::string why;
  if (std::string error = mechanism.error(); !error.empty())
    why = error;
  else if (mechanism.residual() > options_.residual_limit)
    why = "contact residual is " + millimetres(mechanism.residual()) + ", allowed " +
          millimetres(options_.residual_limit);
  else if (progress_.tip_error > options_.most_error)
    why = "path error is " + millimetres(progress_.tip_error) + ", allowed " + millimetres(options_.most_error);
  else
    return {};
  return "at " + std::to_string(std::max(0, progress_.iteration - 1) * options_.parameters.period).substr(0, 6) +
         " s: " + why;
}

/// Keeps the object at its start pose until the path can start.
std::string PathRun::before() {
  if (follower_.mechanism().residual() <= kPrepared * options_.residual_limit) {
    if (std::string why = refusalAtPresentPose(); !why.empty())
      return why;
    part_ = Part::kAlong;
    start_ = follower_.mechanism().pose();
    periods_ = 0;
    return along();
  }
  if (periods_++ * options_.parameters.period >= options_.preparation_time)
    return "before the path: " + kContactsNotReady + " (residual " + millimetres(follower_.mechanism().residual()) +
           ", allowed " + millimetres(kPrepared * options_.residual_limit) + ")";
  ask(planning::heldReference(path_, start_));
  return {};
}

std::string PathRun::along() {
  const double period = options_.parameters.period, time = periods_++ * period;
  ask(planning::pathReference(path_, start_, time, period));
  progress_.iteration = periods_;
  progress_.point = 1 + static_cast<int>((kPoints - 1) * std::min(1.0, time / path_.duration));
  if (time >= path_.duration) {
    part_ = Part::kEnd;
    periods_ = 0;
  }
  return {};
}

std::string PathRun::atEnd() {
  reference_.object.feed_forward.setZero();
  if (progress_.tip_error <= kTolerance) {
    progress_.phase = Phase::kFinished;
    progress_.converged_points = kPoints;
    return {};
  }
  if (periods_++ * options_.parameters.period < kTimeout)
    return {};
  return "error at the end of the path is " + millimetres(progress_.tip_error) + ", allowed " + millimetres(kTolerance);
}

std::string PathRun::next() {
  switch (part_) {
    case Part::kBefore:
      return before();
    case Part::kAlong:
      return along();
    default:
      return atEnd();
  }
}

std::string PathRun::update(const Measured& now, planning::Reference& reference) {
  if (progress_.phase != Phase::kRunning && progress_.phase != Phase::kPaused)
    return {};
  std::string why = now.joints.size() == 0 ? "the measured joints are not valid" : step(now.joints);
  if (!why.empty())
    fail();
  else if (progress_.phase != Phase::kFinished)
    reference = reference_;
  return why;
}

/// @return empty, or why the run failed
std::string PathRun::step(const RobotVector& q) {
  if (const std::string why = follower_.solveEquilibrium(q); !why.empty())
    return "no equilibrium at the present joints: " + why;
  if (progress_.total_iterations > 0)
    progress_.tip_error = planning::trackedError(path_, follower_.mechanism().pose(), wanted_);
  if (part_ != Part::kBefore && progress_.phase == Phase::kRunning)
    errors_.add(progress_.tip_error);
  if (std::string why = part_ == Part::kBefore ? "" : judge(); !why.empty())
    return why;
  if (progress_.phase == Phase::kPaused) {
    if (progress_.total_iterations == 0)
      ask(planning::heldReference(path_, follower_.mechanism().pose()));
    reference_.object.feed_forward.setZero();
    wanted_ = planning::poseOf(reference_.object);
    return {};
  }
  std::string why = next();
  if (why.empty() && progress_.phase == Phase::kRunning)
    ++progress_.total_iterations;
  return why;
}

std::vector<Eigen::Isometry3d> PathRun::points() const {
  std::vector<Eigen::Isometry3d> points;
  for (int k = 0; k <= kPoints; ++k)
    points.push_back(planning::poseOf(planning::pathReference(path_, start_, k * path_.duration / kPoints, 1e-3)));
  return points;
}

}  // namespace tandem::robots
