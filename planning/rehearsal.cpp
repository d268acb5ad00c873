// SPDX-License-Identifier: Apache-2.0
#include "planning/rehearsal.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>

#include "control/obstructing_limits.h"
#include "kinematics/clearance.h"
#include "planning/detail/index.h"
#include "planning/follower.h"
#include "planning/insertion.h"
#include "planning/reference_tracker.h"
#include "planning/report_unit.h"
#include "safety/gate.h"

namespace tandem::planning {
namespace {

/** Joints that are exactly at the setpoints that pass the gate. */
class IdealJoints {
 public:
  IdealJoints(const Arms& arms, const safety::RobotVector& start) : arms_(arms), q_(start) {
    velocity_.setZero(start.size());
    for (const safety::ArmLimits* limits : arms.limits)
      gates_.emplace_back(*limits);
  }

  const Arms& arms() const { return arms_; }
  const safety::RobotVector& position() const { return q_; }

  /// @return false if the gate refuses.
  bool move(const safety::RobotVector& velocity, double period) {
    for (int arm = 0; arm < arms_.count(); ++arm) {
      const int begin = arms_.offset(arm), size = arms_.size(arm);
      const safety::ArmVector last = q_.segment(begin, size), before = velocity_.segment(begin, size);
      const safety::ArmVector now = velocity.segment(begin, size);
      const safety::GateCommand command{0, 0.0, now, last + period * now, period};
      safety::ArmVector setpoint = last;
      if (gates_[at(arm)].check(command, last, before, setpoint).faults != 0)
        return false;
      velocity_.segment(begin, size) = (setpoint - last) / period;
      q_.segment(begin, size) = setpoint;
    }
    return true;
  }

  void measure(Rehearsal& rehearsal) const {
    for (int arm = 0; arm < arms_.count(); ++arm) {
      const int begin = arms_.offset(arm), size = arms_.size(arm);
      rehearsal.largest_violation = std::max(rehearsal.largest_violation,
                                             safety::largestViolation(*arms_.limits[at(arm)], q_.segment(begin, size)));
      rehearsal.fastest_rotation =
          std::max(rehearsal.fastest_rotation, velocity_.segment(begin + size / 2, size / 2).cwiseAbs().maxCoeff());
    }
  }

 private:
  const Arms& arms_;
  std::vector<safety::Gate> gates_;
  safety::RobotVector q_, velocity_;
};

double leastClearance(const Arms& arms, const RehearsedPath& path) {
  double least = safety::kUnlimited;
  if (arms.count() < 2)
    return least;
  std::vector<kinematics::Branch> branches(at(arms.count()));
  std::vector<kinematics::Body> bodies(at(arms.count()));
  for (const RehearsedJoints& now : path.joints) {
    bool solved = true;
    for (int arm = 0; arm < arms.count() && solved; ++arm) {
      const Eigen::VectorXd joints = now.q.segment(arms.offset(arm), arms.size(arm));
      solved = kinematics::makeBody(*arms.models[at(arm)], joints, branches[at(arm)], false, bodies[at(arm)]) ==
               kinematics::ModelStatus::kOk;
    }
    for (int a = 0; a < arms.count() && solved; ++a) {
      for (int b = a + 1; b < arms.count(); ++b)
        least = std::min(least, kinematics::clearance(bodies[at(a)], bodies[at(b)]).distance);
    }
  }
  return least;
}

/// "orientation of a 2.43 deg away (tolerance 2), ": of further tasks that a point has missed.
std::string describeMissed(const TrajectorySpec& spec, const Progress& progress, const std::vector<std::string>& arms) {
  std::string text;
  for (std::size_t k = 0; k < spec.further.size(); ++k) {
    const FurtherTask& task = spec.further[k];
    if (!(progress.further_error[k] > task.tolerance))
      continue;
    TaskReference named;
    named.kind = task.kind;
    named.arm = task.arm;
    named.other_arm = task.other_arm;
    const ReportUnit unit = reportUnit(task.kind);
    std::array<char, 80> amount{};
    std::snprintf(amount.data(), amount.size(), " %.3g %s away (tolerance %.3g), ",
                  unit.per_si * progress.further_error[k], unit.name, unit.per_si * task.tolerance);
    text += describe(named, arms) + amount.data();
  }
  return text;
}

/// @param detail  of a stall: describeMissed()
std::string describeEnd(const Rehearsal& rehearsal, control::Method method, bool relative, const std::string& detail) {
  const std::string who(control::name(method));
  const std::string where = " at point " + std::to_string(rehearsal.point);
  switch (rehearsal.end) {
    case RehearsalEnd::kStalls: {
      std::array<char, 96> errors{};
      std::snprintf(errors.data(), errors.size(),
                    relative ? ", tip %.3g mm and relative position %.3g mm away, " : ", tip %.3g mm away, ",
                    1e3 * rehearsal.tip_error, 1e3 * rehearsal.relative_error);
      std::string text = who + " stalls" + where + errors.data() + detail;
      if (rehearsal.limits.empty())
        return text + "no active limit: the edge of the workspace, or too few iterations for the point";
      text += "limited by ";
      for (std::size_t i = 0; i < rehearsal.limits.size(); ++i)
        text += (i > 0 ? ", " : "") + rehearsal.limits[i];
      return text;
    }
    case RehearsalEnd::kModel:
      return who + where + ": the kinematic model has no solution: " + detail;
    case RehearsalEnd::kSolver:
      return who + where + ": " + detail;
    case RehearsalEnd::kGateRefuses:
      return who + where + ": the gate refuses the step";
    case RehearsalEnd::kCancelled:
      return "cancelled";
    case RehearsalEnd::kInvalid:
      return detail;
    case RehearsalEnd::kCompleted:
      break;
  }
  return {};
}

/** One rehearsal. */
class Run {
 public:
  Run(const Arms& arms, const safety::RobotVector& start, const RehearsalOptions& options)
      : options_(options),
        joints_(arms, start),
        tracker_(arms.models,
                 arms.limits,
                 options.settings.method,
                 options.settings.parameters,
                 options.settings.gains),
        follower_(options.settings.parameters.period) {}

  Rehearsal go(TrajectorySpec spec, const std::vector<safety::RobotVector>& postures) {
    if (!look())
      return end(RehearsalEnd::kInvalid, "the start: " + std::string(kinematics::describe(track_.model)));
    setInsertion(joints_.arms(), joints_.position(), spec);
    follower_.start(spec, pointAt(spec, tracker_.tips(), nullptr), postures);
    result_.points = follower_.progress().point_count;
    int point = 0;
    result_.path.add(0, {joints_.position(), 0});
    while (follower_.update(tracker_.tips(), nullptr, reference_)) {
      if (options_.cancelled && options_.cancelled())
        return end(RehearsalEnd::kCancelled, {});
      if (const int now = follower_.progress().point; now != point) {
        if (point > 0)
          judge(point);
        if (options_.progress)
          options_.progress(now, result_.points);
        point = now;
      }
      tracker_.step(joints_.position(), joints_.position(), reference_, track_);
      if (track_.status == TrackStatus::kModel)
        return end(RehearsalEnd::kModel, std::string(kinematics::describe(track_.model)), point);
      if (track_.status != TrackStatus::kOk)
        return end(RehearsalEnd::kSolver, std::string(control::name(track_.solution.status)), point);
      if (!joints_.move(track_.solution.velocity, options_.settings.parameters.period))
        return end(RehearsalEnd::kGateRefuses, {}, point);
      joints_.measure(result_);
      result_.path.add(++periods_, {joints_.position(), point});
      if (!look())
        return end(RehearsalEnd::kModel, std::string(kinematics::describe(track_.model)), point);
    }
    judge(point);
    return end(follower_.progress().phase == Phase::kFinished ? RehearsalEnd::kCompleted : RehearsalEnd::kStalls,
               missed_);
  }

 private:
  bool look() { return tracker_.computeTips(joints_.position(), track_); }

  /// Records whether the point that has just ended was reached. The tracker still has its last step there.
  void judge(int point) {
    const Progress& progress = follower_.progress();
    result_.converged = progress.converged_points;
    if (progress.missed_points == 0 || result_.point > 0)
      return;
    result_.point = point;
    result_.tip_error = progress.tip_error;
    result_.relative_error = progress.relative_error;
    missed_ = describeMissed(follower_.spec(), progress, options_.arms);
    result_.limits = control::obstructingLimits(tracker_.problem(), options_.settings.parameters, options_.arms, true);
  }

  Rehearsal end(RehearsalEnd how, const std::string& detail, int point = 0) {
    result_.end = how;
    if (point > 0)
      result_.point = point;
    result_.iterations = follower_.progress().total_iterations;
    result_.q = joints_.position();
    if (periods_ > 0)
      result_.path.finish(periods_, {result_.q, follower_.progress().point});
    result_.least_clearance = leastClearance(joints_.arms(), result_.path);
    result_.reason = describeEnd(result_, options_.settings.method, follower_.spec().hasRelative(), detail);
    return result_;
  }

  const RehearsalOptions& options_;
  IdealJoints joints_;
  ReferenceTracker tracker_;
  Follower follower_;
  Reference reference_;
  TrackResult track_;
  Rehearsal result_;
  std::string missed_;  ///< further tasks at the first unreached point
  int periods_ = 0;
};

}  // namespace

void RehearsedPath::add(int period, const RehearsedJoints& at) {
  if (period % stride != 0)
    return;
  if (joints.size() == kMost - 1) {  // one place is that of the end
    for (std::size_t k = 1; 2 * k < joints.size(); ++k)
      joints[k] = joints[2 * k];
    joints.resize((joints.size() + 1) / 2);
    stride *= 2;
    if (period % stride != 0)
      return;
  }
  joints.push_back(at);
}

void RehearsedPath::finish(int period, const RehearsedJoints& at) {
  if (period % stride != 0)
    joints.push_back(at);
}

Rehearsal rehearse(const Arms& arms,
                   const TrajectorySpec& spec,
                   const safety::RobotVector& start,
                   const std::vector<safety::RobotVector>& postures,
                   const RehearsalOptions& options) {
  Rehearsal invalid;
  if (!spec.wrongArms(arms.count()).empty() || start.size() != arms.jointCount() || !start.allFinite()) {
    invalid.reason =
        "the trajectory names an arm that the robot does not have, or the start is not finite or has another number of "
        "joints";
    return invalid;
  }
  try {
    return Run(arms, start, options).go(spec, postures);
  } catch (const std::invalid_argument& error) {
    invalid.reason = error.what();
    return invalid;
  }
}

}  // namespace tandem::planning
