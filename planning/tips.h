// SPDX-License-Identifier: Apache-2.0
/** @file Sources of tip poses: the kinematic model, followed along the joint path, or a tip tracker. */
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "idl/enumerations.h"
#include "kinematics/arm_model.h"
#include "kinematics/tasks/avoidance.h"
#include "kinematics/tasks/shaft_search.h"
#include "planning/reference.h"
#include "safety/dimensions.h"
#include "safety/limits.h"

namespace tandem::planning {

using idl::Feedback;
using idl::name;

/** Tips of all arms by their models, followed along the path of the joints: an elastic arm's tip depends on the past
 * path of the joints, so each arm has its kinematics::Branch. Nothing after construction allocates or throws. */
class TipFollower {
 public:
  /// Without arms: no update succeeds.
  TipFollower() : offset_{0} {}
  /// Models in the robot's order; they must outlive this.
  /// @param limits  in the same order, likewise; empty: tasks of joint limits find nothing near
  explicit TipFollower(std::vector<const kinematics::ArmModel*> models,
                       std::vector<const safety::ArmLimits*> limits = {});

  /// The joints were reset: the next update is a cold start.
  void restart() noexcept;
  /// Continues from the state of another follower of the same models.
  void continueFrom(const TipFollower& other) noexcept;

  /** Updates the tips to joints q, all arms stacked. Arms that have not moved are not computed again, so the number of
   * calls makes no difference. @return false if a model has no solution; status() and failedArm() have the reason. */
  bool update(const safety::RobotVector& q) noexcept;

  int armCount() const noexcept { return static_cast<int>(models_.size()); }
  int jointCount() const noexcept { return offset_.back(); }
  /// Tip in the last update in which the model had a solution.
  const kinematics::Tip& tip(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].tip; }
  /// Points of the arm's shaft at the joints of tip(), evenly spaced from the entry point to its end.
  kinematics::ModelStatus shaft(int arm, int count, std::vector<kinematics::BackbonePoint>& points) const;
  /// Branch of the arm's model in that update.
  const kinematics::Branch& branch(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].branch; }
  /// Point of the arm's shaft nearest to a point (m, robot base frame), at the joints of tip(). Not thread-safe.
  kinematics::ModelStatus shaftPoint(int arm,
                                     const Eigen::Vector3d& to,
                                     bool derivatives,
                                     kinematics::ShaftPoint& foot) const noexcept {
    const Arm& own = arms_[static_cast<std::size_t>(arm)];
    return search_.find(*models_[static_cast<std::size_t>(arm)], own.q, own.branch, to, derivatives, foot);
  }
  /// Nearness of a soft task's arm to what it keeps away from, at the joints of tip().
  /// @param distance  d, above zero
  kinematics::Avoidance avoidance(int arm, kinematics::TaskPoint from, double distance) const noexcept;
  /// Status of the last update: kOk, or that of the first arm whose model had no solution.
  kinematics::ModelStatus status() const noexcept { return status_; }
  int failedArm() const noexcept { return failed_arm_; }
  /// Number of snaps of the model's arm into another equilibrium since construction.
  std::uint32_t snaps(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].snaps; }

 private:
  struct Arm {
    kinematics::Branch branch;
    kinematics::Tip tip;
    safety::ArmVector q;  ///< of the last solution; empty before the first
    std::uint32_t snaps = 0;
  };
  std::vector<const kinematics::ArmModel*> models_;
  std::vector<const safety::ArmLimits*> limits_;  ///< empty: unknown
  std::vector<int> offset_;
  std::array<Arm, safety::kMaxArms> arms_;
  kinematics::ModelStatus status_ = kinematics::ModelStatus::kNotFinite;
  int failed_arm_ = 0;
  mutable kinematics::ShaftSearch search_;  ///< memory of shaftPoint()
};

/** The last valid measurement of each tip; it stays valid while newer ones are invalid, until it is too old. Positions
 * and orientations are valid or not by themselves: a tracker with five degrees of freedom measures no orientation. */
struct MeasuredTips {
  /** When a quantity was measured. */
  struct Origin {
    bool known = false;                 ///< at least one valid measurement
    std::int64_t stamp = 0;             ///< measurement time on the sender's clock, ns
    std::uint64_t answers_command = 0;  ///< last command that the robot had executed then
  };
  struct Entry : Origin {                                             ///< of the position
    Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< m, robot base frame
    Origin oriented;                                                  ///< of the orientation
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< unit, robot base frame <- tip
  };
  std::array<Entry, safety::kMaxArms> arm;
  /// Whether tasks use measured orientations (`orientation_feedback: sensor`) or the model's.
  Feedback orientations = Feedback::kModel;

  bool useOrientations() const noexcept { return orientations == Feedback::kSensor; }
  /// Whether what tasks use of a tip has been measured. @param with_orientation  whether they need its orientation
  bool knows(int k, bool with_orientation = true) const noexcept {
    const Entry& entry = arm[static_cast<std::size_t>(k)];
    return entry.known && (!with_orientation || !useOrientations() || entry.oriented.known);
  }
  /// Takes the measurement of a position. An invalid or not finite one changes nothing.
  void take(int k, bool valid, const Eigen::Vector3d& position, std::int64_t stamp, std::uint64_t answers) noexcept {
    Entry& entry = arm[static_cast<std::size_t>(k)];
    if (!valid || !position.allFinite())
      return;
    static_cast<Origin&>(entry) = {true, stamp, answers};
    entry.position = position;
  }
  /// Takes the measurement of a pose. An orientation that is not finite or not of unit norm changes nothing.
  void take(int k,
            bool valid,
            const Eigen::Vector3d& position,
            const Eigen::Quaterniond& orientation,
            std::int64_t stamp,
            std::uint64_t answers) noexcept {
    take(k, valid, position, stamp, answers);
    if (!valid || !isOrientation(orientation))
      return;
    Entry& entry = arm[static_cast<std::size_t>(k)];
    entry.oriented = {true, stamp, answers};
    entry.orientation = orientation.normalized();
  }
  void forget() noexcept { arm.fill({}); }

  /// Whether a tracker has given an orientation: finite, of unit norm to 1e-3.
  static bool isOrientation(const Eigen::Quaterniond& orientation) noexcept {
    constexpr double kRounding = 1e-3;  // trackers send float or decimal numbers
    return std::abs(orientation.norm() - 1.0) < kRounding;
  }
};

/// The pose of a tip: the model's, with the measured position if there is one, and the measured orientation if tasks
/// use it and there is one. @param measured  null: the model's
inline Eigen::Isometry3d measuredPose(const Eigen::Isometry3d& model, const MeasuredTips* measured, int arm) noexcept {
  Eigen::Isometry3d pose = model;
  if (measured == nullptr)
    return pose;
  const MeasuredTips::Entry& tip = measured->arm[static_cast<std::size_t>(arm)];
  pose.translation() = tip.position;
  if (measured->useOrientations() && tip.oriented.known)
    pose.linear() = tip.orientation.toRotationMatrix();
  return pose;
}

/// Calls f(arm, with_orientation) for every arm in the tasks, possibly more than once, and also for arms that do not
/// exist. @tparam F  void(int, bool); the second: whether the task needs the orientation of the tip
template <class F>
void forEachArm(const Reference& tasks, F f) {
  for (int t = 0; t < std::min(tasks.task_count, kMaxTasks); ++t) {
    const TaskReference& task = tasks.tasks[static_cast<std::size_t>(t)];
    const auto* kind = kinematics::findTaskKind(task.kind);
    const bool with_orientation = kind != nullptr && kind->needsOrientation();
    f(task.arm, with_orientation);
    if (kind != nullptr && kind->relative())
      f(task.other_arm, with_orientation);
  }
}

/// Age of the oldest measurement in use of an arm's tip, by `age_of`(origin); infinite without one.
template <class F>
double measuredAge(const MeasuredTips& tips, int arm, bool with_orientation, F age_of) {
  const MeasuredTips::Entry& tip = tips.arm[static_cast<std::size_t>(arm)];
  const auto age = [&](const MeasuredTips::Origin& origin) {
    return origin.known ? static_cast<double>(age_of(origin)) : safety::kUnlimited;
  };
  return with_orientation && tips.useOrientations() ? std::max(age(tip), age(tip.oriented)) : age(tip);
}

}  // namespace tandem::planning
