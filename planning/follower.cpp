// SPDX-License-Identifier: Apache-2.0
#include "planning/follower.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "planning/detail/further_tasks.h"

namespace tandem::planning {
namespace {

/// Distance travelled and speed after t seconds of a trapezoidal speed profile over `length`.
struct Profile {
  double length, speed, acceleration;

  double peak() const { return std::min(speed, std::sqrt(length * acceleration)); }
  double duration() const { return length / peak() + peak() / acceleration; }
  double distance(double t) const {
    const double v = peak(), ramp = v / acceleration, end = duration();
    if (t <= 0.0)
      return 0.0;
    if (t >= end)
      return length;
    if (t < ramp)
      return 0.5 * acceleration * t * t;
    if (t > end - ramp)
      return length - 0.5 * acceleration * (end - t) * (end - t);
    return v * (t - 0.5 * ramp);
  }
};

}  // namespace

void Follower::start(const TrajectorySpec& spec,
                     const TrajectoryPoint& measured,
                     std::vector<safety::RobotVector> postures) {
  const auto* insertion = std::get_if<Insertion>(&spec.shape);
  if (insertion != nullptr && postures.empty())
    postures = insertion->joints;
  startAt(spec, measured, sample(spec, measured), std::move(postures));
}

void Follower::startAt(const TrajectorySpec& spec,
                       const TrajectoryPoint& measured,
                       std::vector<TrajectoryPoint> points,
                       std::vector<safety::RobotVector> postures) {
  if (static_cast<int>(points.size()) != spec.point_count || points.empty()) {
    throw std::invalid_argument("trajectory '" + spec.name + "': found " + std::to_string(points.size()) +
                                " points, expected " + std::to_string(spec.point_count));
  }
  if (!postures.empty() && postures.size() != points.size()) {
    throw std::invalid_argument("postures: found " + std::to_string(postures.size()) + ", expected one for each of " +
                                std::to_string(points.size()) + " points");
  }
  postures_ = std::move(postures);
  spec_ = spec;
  points_ = std::move(points);
  points_.insert(points_.begin(), wantedAtStart(spec, measured));
  arc_length_.assign(points_.size(), 0.0);
  for (std::size_t i = 1; i < points_.size(); ++i) {
    arc_length_[i] = arc_length_[i - 1] + (points_[i].tip - points_[i - 1].tip).norm();
  }
  leader_.clear();
  path_time_ = 0.0;
  passed_.clear();
  passed_.reserve(points_.size());
  errors_ = {};
  progress_ = Progress{};
  progress_.phase = Phase::kRunning;
  progress_.point_count = spec.point_count;
  for (const FurtherTask& task : spec.further) {
    if (std::isfinite(task.tolerance))
      progress_.tolerance = spec.tolerance;
  }
}

void Follower::stop() { progress_.phase = Phase::kIdle; }

void Follower::fail() { progress_.phase = Phase::kFailed; }

void Follower::pause() {
  if (progress_.phase == Phase::kRunning)
    progress_.phase = Phase::kPaused;
}

void Follower::resume() {
  if (progress_.phase == Phase::kPaused)
    progress_.phase = Phase::kRunning;
}

double Follower::errorOf(const TrajectoryPoint& wanted, const TrajectoryPoint& measured) const noexcept {
  double error = std::max((wanted.tip - measured.tip).norm(), (wanted.relative - measured.relative).norm());
  for (std::size_t k = 0; k < spec_.further.size(); ++k) {
    const FurtherTask& task = spec_.further[k];
    if (!std::isfinite(task.tolerance))
      continue;
    const double own = task.follows_leader
                           ? progress_.further_error[k]  // of all points that the tip has passed
                           : kinematics::findTaskKind(task.kind)->error(measured.further[k], wanted.further[k]);
    error = std::max(error, spec_.tolerance / task.tolerance * own);
  }
  return error;
}

bool Follower::update(const TipFollower& tips, const MeasuredTips* measured, Reference& reference) noexcept {
  for (std::size_t k = 0; k < spec_.further.size(); ++k) {
    FurtherTask& task = spec_.further[k];
    const bool shaft = kinematics::findTaskKind(task.kind)->point == kinematics::TaskPoint::kShaft;
    if (shaft && progress_.total_iterations > 0)
      task.target = wanted_.further[k].position;  // it may move from point to point
    if (!task.follows_leader)
      continue;
    if (leader_.empty())
      leader_.start(tips, task.arm);
    task.target = leader_.farthest(tips);
    wanted_.further[k].position = task.target;
  }
  const int before = progress_.point;
  const bool running = update(pointAt(spec_, tips, measured), reference);
  if (before > 0 && progress_.point > before)
    leader_.pass(tips);  // where the tip has got to, not where it should have
  return running;
}

void Follower::aimAtLeader() noexcept {
  for (std::size_t k = 0; k < spec_.further.size(); ++k) {
    const FurtherTask& task = spec_.further[k];
    if (!task.follows_leader)
      continue;
    wanted_.further[k].position = task.target;
    reference_.tasks[static_cast<std::size_t>(task.priority)].position = task.target;
  }
}

bool Follower::update(const TrajectoryPoint& measured, Reference& reference) noexcept {
  if (progress_.phase != Phase::kRunning && progress_.phase != Phase::kPaused)
    return false;
  if (progress_.total_iterations > 0) {
    progress_.tip_error = (wanted_.tip - measured.tip).norm();
    progress_.relative_error = (wanted_.relative - measured.relative).norm();
    for (std::size_t k = 0; k < spec_.further.size(); ++k)
      progress_.further_error[k] =
          kinematics::findTaskKind(spec_.further[k].kind)->error(measured.further[k], wanted_.further[k]);
    error_ = errorOf(wanted_, measured);
  }
  if (progress_.phase == Phase::kPaused) {
    if (progress_.total_iterations == 0)
      ask(points_.front(), referenceTo(spec_, points_.front()));
    for (TaskReference& task : reference_.tasks)
      task.clearFeedForward();
    aimAtLeader();
    reference = reference_;
    return true;
  }
  const bool running = spec_.following == Following::kPointByPoint ? nextPoint() : nextInstant(measured);
  if (running) {
    ++progress_.total_iterations;
    aimAtLeader();
    reference = reference_;
  }
  return running;
}

void Follower::addErrors() noexcept {
  std::size_t next = 0;
  for (int t = 0; t < reference_.task_count; ++t) {
    ErrorStatistics& errors = errors_[static_cast<std::size_t>(t)];
    if (next < spec_.further.size() && spec_.further[next].priority == t)
      errors.add(progress_.further_error[next++]);
    else
      errors.add(reference_.tasks[static_cast<std::size_t>(t)].kind == TaskKind::kRelativePosition
                     ? progress_.relative_error
                     : progress_.tip_error);
  }
}

void Follower::leave(int point, double error) noexcept {
  ++(error <= spec_.tolerance ? progress_.converged_points : progress_.missed_points);
  if (progress_.worst_point == 0 || error > progress_.worst_error) {
    progress_.worst_error = error;
    progress_.worst_point = point;
  }
}

void Follower::finish() noexcept { progress_.phase = progress_.missed_points == 0 ? Phase::kFinished : Phase::kFailed; }

bool Follower::nextPoint() noexcept {
  const bool started = progress_.point > 0;
  if (started && !(error_ <= spec_.tolerance) && progress_.iteration < spec_.max_iterations) {
    ++progress_.iteration;
    for (TaskReference& task : reference_.tasks)
      task.clearFeedForward();
    return true;
  }
  if (started) {
    addErrors();
    leave(progress_.point, error_);
  }
  if (progress_.point == progress_.point_count) {
    finish();
    return false;
  }
  ++progress_.point;
  progress_.iteration = 1;
  const TrajectoryPoint& from = points_[progress_.point - 1];
  const TrajectoryPoint& to = points_[progress_.point];
  ask(to, referenceTo(spec_, to, from, to, spec_.point_duration));
  if (!postures_.empty())
    reference_.posture = postures_[static_cast<std::size_t>(progress_.point) - 1];
  return true;
}

std::pair<std::size_t, double> Follower::pieceAt(double s) const noexcept {
  const auto above = std::upper_bound(arc_length_.begin() + 1, arc_length_.end() - 1, s);
  const auto i = static_cast<std::size_t>(above - arc_length_.begin());
  const double piece = arc_length_[i] - arc_length_[i - 1];
  return {i, piece > 0.0 ? std::clamp((s - arc_length_[i - 1]) / piece, 0.0, 1.0) : 1.0};
}

TrajectoryPoint Follower::along(double s) const noexcept {
  const auto [i, share] = pieceAt(s);
  return between(spec_, points_[i - 1], points_[i], share);
}

void Follower::judgePassed(const TrajectoryPoint& measured) noexcept {
  bool last = false;  // the last point is decided, and with it all others: it comes first here
  for (std::size_t i = passed_.size(); i-- > 0;) {
    Passed& passed = passed_[i];
    if (passed.periods < 0)
      continue;
    passed.nearest = std::min(passed.nearest, errorOf(points_[i + 1], measured));
    if (last || passed.nearest <= spec_.tolerance || passed.periods++ >= spec_.max_iterations) {
      last = last || i + 2 == points_.size();
      passed.periods = -1;
      leave(static_cast<int>(i) + 1, passed.nearest);
    }
  }
}

bool Follower::nextInstant(const TrajectoryPoint& measured) noexcept {
  const Profile profile{arc_length_.back(), spec_.speed, spec_.acceleration};
  const double end = profile.duration();
  // Reference at this update, and its mean velocity up to the next update.
  const double s = profile.distance(path_time_), s_next = profile.distance(path_time_ + period_);
  const TrajectoryPoint now = along(s), next = along(s_next);
  while (passed_.size() + 1 < points_.size() && (path_time_ >= end || arc_length_[passed_.size() + 1] <= s))
    passed_.push_back({std::numeric_limits<double>::infinity(), 0});
  if (progress_.total_iterations > 0)
    addErrors();
  judgePassed(measured);
  if (progress_.converged_points + progress_.missed_points == progress_.point_count) {
    finish();
    return false;
  }
  path_time_ = std::min(path_time_ + period_, end);
  ask(now, referenceTo(spec_, now, now, next, period_));
  if (!postures_.empty()) {
    const auto [i, share] = pieceAt(s);  // before the first point only its posture is known
    const std::size_t before = std::max<std::size_t>(i, 2) - 2;
    reference_.posture = postures_[before] + share * (postures_[i - 1] - postures_[before]);
  }
  progress_.point = static_cast<int>(std::upper_bound(arc_length_.begin(), arc_length_.end(), s) - arc_length_.begin());
  progress_.point = std::clamp(progress_.point, 1, progress_.point_count);
  ++progress_.iteration;
  return true;
}

std::string describeMisses(const Progress& progress) {
  if (progress.missed_points == 0)
    return {};
  std::array<char, 120> text{};
  const bool in_tolerances = progress.tolerance > 0.0;
  std::snprintf(text.data(), text.size(), "missed %d of %d points, worst %.3g %s at point %d", progress.missed_points,
                progress.point_count, progress.worst_error * (in_tolerances ? 1.0 / progress.tolerance : 1e3),
                in_tolerances ? "times the tolerance" : "mm", progress.worst_point);
  return text.data();
}

void Follower::ask(const TrajectoryPoint& at, const Reference& reference) noexcept {
  wanted_ = at;
  reference_ = reference;
}

}  // namespace tandem::planning
