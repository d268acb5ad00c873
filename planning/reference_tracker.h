// SPDX-License-Identifier: Apache-2.0
/** @file Reference tracker: one control step, from joint positions and a reference to joint velocities of all arms. */
#pragma once

#include <memory>
#include <vector>

#include "control/resolver.h"
#include "kinematics/arm_model.h"
#include "planning/equilibrium.h"
#include "planning/margins.h"
#include "planning/reference.h"
#include "planning/tips.h"
#include "safety/limits.h"

namespace tandem::planning {

/** Gains of v = lambda (x_d - x) + xdot_d per task kind, 1/s (Alsaka et al. 2024, below (3)). */
struct Gains {
  double relative = 5.0;  ///< lambda_AB
  double tip = 3.0;       ///< lambda_A
};

enum class TrackStatus : std::uint8_t {
  kOk = 0,
  kModel,          ///< a kinematic model cannot answer for these joints
  kReference,      ///< the reference names an arm that there is not, or holds a number that is not finite
  kSolver,         ///< see Solution::status
  kSensor,         ///< the tip of an arm that the reference names has not been measured
  kNoEquilibrium,  ///< no equilibrium of the common object is known
};

/** Result of one step. Reused from step to step. */
struct TrackResult {
  TrackStatus status = TrackStatus::kOk;
  kinematics::ModelStatus model = kinematics::ModelStatus::kOk;
  int model_arm = 0;                                    ///< whose model could not answer
  control::Solution solution;                           ///< velocity is zero unless status is kOk
  int first_task = 0;                                   ///< of the problem: the reference's; others may come before
  std::array<double, kMaxTasks> error{};                ///< |x_d - x| per task, m; of a frame, a radian counts length
  std::array<kinematics::Tip, safety::kMaxArms> tip{};  ///< the model's, at the joint positions given
};

/** Follows references with a redundancy-resolution method. step() allocates nothing and throws nothing with the
 * active-set backend. The relative Jacobian of tip A minus tip B is J_AB = [J_A, -J_B] in the common base frame (eq.
 * (2)). */
class ReferenceTracker {
 public:
  /// Arms in the robot's order; models and limits must outlive the tracker.
  ReferenceTracker(std::vector<const kinematics::ArmModel*> models,
                   std::vector<const safety::ArmLimits*> limits,
                   control::Method method,
                   const control::MethodParameters& parameters,
                   Gains gains);

  /// A tracker of the common frame that the arms move together; it has no tips.
  /// @param posture  of all joints: where they go as far as no task asks for anything else
  static ReferenceTracker ofObject(const std::vector<const safety::ArmLimits*>& limits,
                                   const safety::RobotVector& posture,
                                   control::Method method,
                                   const control::MethodParameters& parameters,
                                   Gains gains);

  /// Step of the common object, with the hierarchy: tasks of higher priority, the object's pose, tasks of lower
  /// priority, the posture. Gains::relative applies to the higher- and lower-priority tasks, Gains::tip to the pose.
  /// @param rest  equilibrium near q, extrapolated to q to first order
  /// @param setpoint  joints from which the velocities are integrated; limits refer to them
  void step(const Equilibrium& rest,
            const safety::RobotVector& q,
            const safety::RobotVector& setpoint,
            const ObjectReference& reference,
            TrackResult& result) noexcept;

  /// Joints displaced, inside their box.
  safety::RobotVector moved(const safety::RobotVector& q, const safety::RobotVector& by) const noexcept;

  /// Tips, errors and joint velocities.
  /// @param q  measured joints, all arms stacked: where the tips are
  /// @param setpoint  the joints from which the velocities will be integrated: where limits are counted from
  /// @param measured  tips to compute the errors with, fresh ones; nullptr: the model's
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

  /// A cycle without motion for a reason: tips and limits, zero velocity.
  void hold(const safety::RobotVector& q,
            const safety::RobotVector& setpoint,
            TrackStatus reason,
            TrackResult& result) noexcept;

  /// Tips alone. @return false where a model cannot answer; then result.model and model_arm say why.
  bool computeTips(const safety::RobotVector& q, TrackResult& result) noexcept;

  /// Refreshes problem()'s moving limits and follows the joints, without a step.
  void observe(const safety::RobotVector& q, const safety::RobotVector& setpoint) noexcept;

  /// The joints were put elsewhere without a path.
  void restart() noexcept { tips_.restart(); }
  /// Takes over from a tracker of the same robot and model that has followed the joints so far.
  void continueFrom(const ReferenceTracker& other) noexcept { tips_.continueFrom(other.tips_); }
  /// The model's tips along the path of the joints.
  const TipFollower& tips() const noexcept { return tips_; }

  /// Limits and bounds as the last step or observe() saw them.
  const control::StepProblem& problem() const { return problem_; }
  control::Method method() const { return resolver_->method(); }
  int jointCount() const { return problem_.joint_count; }
  const Gains& gains() const { return gains_; }

 private:
  ReferenceTracker(control::Method method, const control::MethodParameters& parameters, Gains gains)
      : margins_({}, parameters), resolver_(control::makeResolver(method, parameters)), gains_(gains) {}
  void clear(TrackResult& result) const noexcept;
  void addEquilibriumTask(const EquilibriumTask& from, const safety::RobotVector& away) noexcept;
  double addObjectTask(const Equilibrium& rest,
                       const safety::RobotVector& away,
                       const ObjectReference& reference) noexcept;
  void solve(TrackResult& result) noexcept;
  TrackStatus setTask(const TaskReference& wanted,
                      const MeasuredTips* measured,
                      const TrackResult& result,
                      control::Task& task,
                      double& error) noexcept;

  TipFollower tips_;
  Margins margins_;
  std::unique_ptr<control::Resolver> resolver_;
  Gains gains_;
  control::StepProblem problem_;
  safety::RobotVector posture_;  ///< of arms that move a common object
};

}  // namespace tandem::planning
