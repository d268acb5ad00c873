// SPDX-License-Identifier: Apache-2.0
/** @file Manual control of tips and joints by operators with a device and by CRTK clients. */
#pragma once

#include "operation/crtk_motion.h"
#include "operation/operator_input_handler.h"
#include "operation/task_loop.h"

namespace tandem::operation {

/** How motions of CRTK clients ended in one cycle. */
struct CrtkEndings {
  std::array<CrtkOutcome, kCrtkGroups + 1> outcome{};
  int count = 0;
};

/** An operator comes before CRTK clients. Nothing allocates after construction, locks or throws; times are ns. */
class ManualControl {
 public:
  /// Keeps `drives` by reference.
  ManualControl(const ControlSetup& setup, const DriveExchange& drives);

  void onInput(const msg::TeleopInput& input, const OperatorInputHandler::Context& context) noexcept {
    operator_.take(input, context);
  }
  /// A stream, a motion of a tip, or hold, that judge() allows. @return false where it is refused; the outcome says why
  bool onCrtk(const CrtkRequest& request, std::int64_t now, CrtkOutcome& outcome) noexcept {
    return crtk_.take(request, scene(now), outcome);
  }
  /// Ends what CRTK clients have begun with an arm.
  void endCrtk(int arm) noexcept { crtk_.end(arm); }

  /// Looks where the tips are. Before judge() and choose().
  void locate(TaskLoop& loop) noexcept { tips_known_ = loop.findTips(tips_); }
  void forgetTips() noexcept { tips_known_ = false; }
  bool tipsKnown() const noexcept { return tips_known_; }

  /// Somebody moves the robot.
  bool active() const noexcept { return operator_.engaged() || crtk_.active(); }
  bool engaged() const noexcept { return operator_.engaged(); }
  const CrtkMotion& crtk() const noexcept { return crtk_; }

  /** Who moves tips in this cycle, and the tasks that follow. Ends what can no longer be done.
   * @return kTeleoperation, kCrtk, or kNobody: the tasks then are what they were */
  msg::Source choose(const OperatorInputHandler::Context& context,
                     const RobotCondition& condition,
                     const planning::Gains& gains,
                     planning::Reference& tasks,
                     CrtkEndings& endings) noexcept;
  /// The tips cannot be moved now.
  void invalidateTips() noexcept;
  /// Velocities of an arm whose joints a CRTK client moves.
  safety::ArmVector jointVelocity(int arm, std::int64_t now) noexcept { return crtk_.jointVelocity(arm, scene(now)); }
  /** Where limits are in the way, tips do not go straight to their targets: what these velocities, and those that are
   * under way, would do to the tips must not lead into a forbidden region either. All joints slow down together. */
  void keepOut(const planning::TrackResult& result, safety::RobotVector& velocity) noexcept;

  /// For the thread that publishes; after the cycle. @param tasks  of the trajectory, or of `source`; null: none
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
  int kept_out_of_ = -1;  ///< the forbidden region that held this cycle's motion back
};

}  // namespace tandem::operation
