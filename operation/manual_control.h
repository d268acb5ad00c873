// SPDX-License-Identifier: Apache-2.0
/** @file Manual control of tips and joints by operators with a device and by CRTK clients. */
#pragma once

#include "operation/crtk_motion.h"
#include "operation/operator_input_handler.h"
#include "operation/task_loop.h"

namespace tandem::operation {

/** Ends of CRTK clients' motions in one cycle. */
struct CrtkEndings {
  std::array<CrtkOutcome, kCrtkGroups + 1> outcome{};
  int count = 0;
};

/** Operators have precedence over CRTK clients. Nothing allocates after construction, locks or throws; times are ns. */
class ManualControl {
 public:
  /// Keeps `drives` by reference.
  ManualControl(const ControlSetup& setup, const DriveExchange& drives);

  void onInput(const msg::TeleopInput& input, const OperatorInputHandler::Context& context) noexcept {
    operator_.take(input, context);
  }
  /// A stream, a tip motion or hold, allowed by judge(). @return false if it is refused; the outcome has the reason
  bool onCrtk(const CrtkRequest& request, std::int64_t now, CrtkOutcome& outcome) noexcept {
    return crtk_.take(request, scene(now), outcome);
  }
  /// Ends the motions of CRTK clients with an arm.
  void endCrtk(int arm) noexcept { crtk_.end(arm); }

  /// Computes the tip poses. Call before judge() and choose().
  void locate(TaskLoop& loop) noexcept { tips_known_ = loop.findTips(tips_); }
  void forgetTips() noexcept { tips_known_ = false; }
  bool tipsKnown() const noexcept { return tips_known_; }

  /// An operator or CRTK client moves the robot.
  bool active() const noexcept { return operator_.engaged() || crtk_.active(); }
  bool engaged() const noexcept { return operator_.engaged(); }
  const CrtkMotion& crtk() const noexcept { return crtk_; }

  /** Source of tip motion in this cycle, and its tasks. Ends motions that are no longer possible.
   * @return kTeleoperation, kCrtk, or kNobody, which leaves `tasks` unchanged */
  msg::Source choose(const OperatorInputHandler::Context& context,
                     const RobotCondition& condition,
                     const planning::Gains& gains,
                     planning::Reference& tasks,
                     CrtkEndings& endings) noexcept;
  /// Stops all tip motion: the tips cannot be moved now.
  void invalidateTips() noexcept;
  /// Velocities of an arm whose joints a CRTK client moves.
  safety::ArmVector jointVelocity(int arm, std::int64_t now) noexcept { return crtk_.jointVelocity(arm, scene(now)); }
  /** Active limits divert tips from the straight line to their targets: this keeps the tips out of forbidden regions
   * under these velocities and those not yet executed. All joints slow down in proportion. */
  void keepOut(const planning::TrackResult& result, safety::RobotVector& velocity) noexcept;

  /// Snapshots for the publishing thread, after the cycle. @param tasks  of the trajectory, or of `source`; null: none
  void fill(const OperatorInputHandler::Context& context,
            msg::Source source,
            const planning::Reference* tasks,
            OperatorSnapshot& operators,
            CrtkSnapshot& crtk) const noexcept;

 private:
  CrtkMotion::Scene scene(std::int64_t now) const noexcept {
    return {now, &drives_.setpoints(), tips_known_ ? &tips_ : nullptr};
  }
  bool operate(const OperatorInputHandler::Context& context, const RobotCondition& condition) noexcept;
  void finishCrtkMotions(const RobotCondition& condition, std::int64_t now, CrtkEndings& endings) noexcept;
  void fillTargets(const planning::Reference& tasks, OperatorSnapshot& operators) const noexcept;

  ControlSetup setup_;
  const DriveExchange& drives_;
  OperatorInputHandler operator_;
  CrtkMotion crtk_;
  bool tips_known_ = false;
  planning::teleoperation::TipPlaces tips_;
  int kept_out_of_ = -1;  ///< the forbidden region that slowed this cycle's motion
};

}  // namespace tandem::operation
