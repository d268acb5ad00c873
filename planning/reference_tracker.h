// SPDX-License-Identifier: Apache-2.0
/** @file Reference tracker: one control step, from joint positions and a reference to joint velocities of all arms. */
#pragma once

#include <memory>
#include <vector>

#include "control/resolver.h"
#include "kinematics/arm_model.h"
#include "planning/equilibrium.h"
#include "planning/gains.h"
#include "planning/margins.h"
#include "planning/reference.h"
#include "planning/tips.h"
#include "safety/limits.h"

namespace tandem::planning {

enum class TrackStatus : std::uint8_t {
  kOk = 0,
  kModel,          ///< a kinematic model has no solution at these joints
  kReference,      ///< the reference names an arm that does not exist, or has a value that is not finite
  kSolver,         ///< see Solution::status
  kSensor,         ///< the tip of an arm in the reference has not been measured
  kNoEquilibrium,  ///< no equilibrium of the common object is known
};

/** Result of one step. Reused from step to step. */
struct TrackResult {
  TrackStatus status = TrackStatus::kOk;
  kinematics::ModelStatus model = kinematics::ModelStatus::kOk;
  int model_arm = 0;           ///< arm whose model has no solution
  control::Solution solution;  ///< velocity is zero unless status is kOk
  int first_task = 0;          ///< first index of the reference's tasks in the problem; others may precede them
  /// |x_d - x| per task, m; radians times length for a frame, times kinematics::kLengthPerRadian for an axis or an
  /// orientation.
  std::array<double, kMaxTasks> error{};
  std::array<kinematics::Tip, safety::kMaxArms> tip{};  ///< the model's, at the joint positions given
};

/** Follows references with a redundancy-resolution method. step() does not allocate or throw with the active-set
 * backend. Rows of the tasks are those of kinematics/tasks/task_kind.h; for the relative position of tip A and tip B
 * J_AB = [J_A, -J_B] in the common base frame (eq. (2)). All rows are in metres: see kinematics::kLengthPerRadian. */
class ReferenceTracker {
 public:
  /// Arms in the robot's order; models and limits must outlive the tracker.
  ReferenceTracker(std::vector<const kinematics::ArmModel*> models,
                   std::vector<const safety::ArmLimits*> limits,
                   control::Method method,
                   const control::MethodParameters& parameters,
                   Gains gains);

  /// Tracker of a common object; it has no tips. @param posture  of all joints: their goal as far as tasks leave them
  /// free
  static ReferenceTracker ofObject(const std::vector<const safety::ArmLimits*>& limits,
                                   const safety::RobotVector& posture,
                                   control::Method method,
                                   const control::MethodParameters& parameters,
                                   Gains gains);

  /// Step of the common object, with the hierarchy: tasks of higher priority, the object's pose, tasks of lower
  /// priority, the posture. Gains::relative applies to the higher- and lower-priority tasks, Gains::tip to the pose.
  /// @param equilibrium  equilibrium near q, extrapolated to q to first order
  /// @param setpoint  joints from which the velocities are integrated; limits refer to them
  void step(const Equilibrium& equilibrium,
            const safety::RobotVector& q,
            const safety::RobotVector& setpoint,
            const ObjectReference& reference,
            TrackResult& result) noexcept;

  /// Joints displaced, inside their box.
  safety::RobotVector moved(const safety::RobotVector& q, const safety::RobotVector& by) const noexcept;

  /// Tips, errors and joint velocities.
  /// @param q  measured joints, all arms stacked: tips are computed from them
  /// @param setpoint  joints from which the velocities are integrated: limits refer to them
  /// @param measured  fresh positions of tips for the errors, and orientations if it says so; nullptr: the model's.
  /// Jacobians are always the model's.
  void step(const safety::RobotVector& q,
            const safety::RobotVector& setpoint,
            const Reference& reference,
            const MeasuredTips* measured,
            TrackResult& result) noexcept;
  /// The same with the model's tips.
  void step(const safety::RobotVector& q,
            const safety::RobotVector& setpoint,
            const Reference& reference,
            TrackResult& result) noexcept {
    step(q, setpoint, reference, nullptr, result);
  }

  /// A cycle without motion for a reason: computes tips and limits, zero velocity.
  void hold(const safety::RobotVector& q,
            const safety::RobotVector& setpoint,
            TrackStatus reason,
            TrackResult& result) noexcept;

  /// Computes the tips only. @return false if a model has no solution; result.model and model_arm have the reason.
  bool computeTips(const safety::RobotVector& q, TrackResult& result) noexcept;

  /// Updates problem()'s moving limits and follows the joints, without a step.
  void observe(const safety::RobotVector& q, const safety::RobotVector& setpoint) noexcept;

  /// The joints were reset: the next step is a cold start of models and method.
  void restart() noexcept {
    tips_.restart();
    resolver_->reset();
  }
  /// Continues from the state of a tracker of the same robot and model.
  void continueFrom(const ReferenceTracker& other) noexcept { tips_.continueFrom(other.tips_); }
  /// Tips of the model along the path of the joints.
  const TipFollower& tips() const noexcept { return tips_; }

  /// Limits and bounds of the last step or observe().
  const control::StepProblem& problem() const { return problem_; }
  control::Method method() const { return resolver_->method(); }
  int jointCount() const { return problem_.joint_count; }
  const Gains& gains() const { return gains_; }

 private:
  ReferenceTracker(control::Method method, const control::MethodParameters& parameters, Gains gains)
      : margins_({}, parameters), resolver_(control::makeResolver(method, parameters)), gains_(gains) {}
  void clear(TrackResult& result) const noexcept;
  void addEquilibriumTask(const EquilibriumTask& from, const safety::RobotVector& away) noexcept;
  double addObjectTask(const Equilibrium& equilibrium,
                       const safety::RobotVector& away,
                       const ObjectReference& reference) noexcept;
  void solve(TrackResult& result) noexcept;
  TrackStatus setTask(const TaskReference& wanted,
                      const MeasuredTips* measured,
                      TrackResult& result,
                      control::Task& task,
                      double& error) noexcept;
  TrackStatus setSoftTask(const TaskReference& wanted,
                          const kinematics::TaskKindEntry& kind,
                          control::Task& task,
                          double& error) noexcept;

  TipFollower tips_;
  kinematics::ShaftPoint foot_;  ///< of the last task of a shaft
  Margins margins_;
  std::unique_ptr<control::Resolver> resolver_;
  Gains gains_;
  control::StepProblem problem_;
  safety::RobotVector posture_;  ///< of arms that move a common object
};

}  // namespace tandem::planning
