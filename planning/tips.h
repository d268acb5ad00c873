// SPDX-License-Identifier: Apache-2.0
/** @file Sources of tip poses: the kinematic model, followed along the joint path, or a tip tracker. */
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "idl/enumerations.h"
#include "kinematics/arm_model.h"
#include "planning/reference.h"
#include "safety/dimensions.h"

namespace tandem::planning {

using idl::Feedback;
using idl::name;

/** Tips of all arms by their models, followed along the path of the joints: an elastic arm's tip depends on the way
 * that the joints have come, so each arm keeps its kinematics::Branch. Nothing after construction allocates or throws.
 */
class TipFollower {
 public:
  /// Of no arms: no update has an answer.
  TipFollower() : offset_{0} {}
  /// Models in the robot's order; they must outlive this.
  explicit TipFollower(std::vector<const kinematics::ArmModel*> models);

  /// The joints were put elsewhere without a path: the next update is a cold start.
  void restart() noexcept;
  /// Goes on from where another one stands, which follows the same models.
  void continueFrom(const TipFollower& other) noexcept;

  /** The joints are at q now, all arms stacked. Nothing is computed for an arm that has not moved, so how often this is
   * called makes no difference. @return false where a model cannot answer: status() and failedArm() say why. */
  bool update(const safety::RobotVector& q) noexcept;

  int armCount() const noexcept { return static_cast<int>(models_.size()); }
  int jointCount() const noexcept { return offset_.back(); }
  /// Of the last update in which the model could answer.
  const kinematics::Tip& tip(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].tip; }
  /// The branch that the arm's model is on since then.
  const kinematics::Branch& branch(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].branch; }
  /// Of the last update: kOk, or that of the first arm whose model could not answer.
  kinematics::ModelStatus status() const noexcept { return status_; }
  int failedArm() const noexcept { return failed_arm_; }
  /// How often the model's arm has snapped into another equilibrium since construction.
  std::uint32_t snaps(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].snaps; }

 private:
  struct Arm {
    kinematics::Branch branch;
    kinematics::Tip tip;
    safety::ArmVector q;  ///< of the last answer; empty before the first
    std::uint32_t snaps = 0;
  };
  std::vector<const kinematics::ArmModel*> models_;
  std::vector<int> offset_;
  std::array<Arm, safety::kMaxArms> arms_;
  kinematics::ModelStatus status_ = kinematics::ModelStatus::kNotFinite;
  int failed_arm_ = 0;
};

/** The last good measurement of each tip. One that drops out leaves the one before it in force, until that is too old.
 */
struct MeasuredTips {
  struct Entry {
    bool known = false;                                  ///< there has been a good one
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, robot base frame
    std::int64_t stamp = 0;                              ///< when it was made, on the clock of whoever measured, ns
    std::uint64_t answers_command = 0;                   ///< the last command that the robot had taken by then
  };
  std::array<Entry, safety::kMaxArms> arm;

  /// Takes a measurement of one arm. A bad one, or one that is not finite, changes nothing.
  void take(int k, bool valid, const Eigen::Vector3d& position, std::int64_t stamp, std::uint64_t answers) noexcept {
    if (valid && position.allFinite())
      arm[static_cast<std::size_t>(k)] = {true, position, stamp, answers};
  }
  void forget() noexcept { arm.fill({}); }
};

/// Calls f(arm) for every arm that the tasks name, some more than once; for numbers that no arm has, too.
template <class F>
void forEachArm(const Reference& tasks, F f) {
  for (int t = 0; t < std::min(tasks.task_count, kMaxTasks); ++t) {
    const TaskReference& task = tasks.tasks[static_cast<std::size_t>(t)];
    f(task.arm);
    if (task.kind == TaskKind::kRelativePosition)
      f(task.other_arm);
  }
}

}  // namespace tandem::planning
