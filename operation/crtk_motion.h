// SPDX-License-Identifier: Apache-2.0
/** @file CRTK motions of the arms and of the pair: tip targets and joint velocities in each cycle.
 * For the periodic thread; nothing here allocates, locks or throws after construction. */
#pragma once

#include <vector>

#include "operation/joint_stream.h"
#include "planning/reference_tracker.h"
#include "planning/teleoperation/pipeline.h"

namespace tandem::operation {

/** Streams and Cartesian motions; joint motions to one goal (move_jp, move_jr) are control's own.
 *
 * Each arm has a group, which is moved by its joints or by its tip, and the pair, the first two arms, has one: x_AB,
 * tip of the first arm minus tip of the second. While the pair is moved, the tip of the first arm stays, or goes where
 * a Cartesian command of its own sends it, and the second arm gives way; a Cartesian command to the second arm ends the
 * pair's, and the other way round. */
class CrtkMotion {
 public:
  explicit CrtkMotion(const ControlSetup& setup);

  /** What control knows. */
  struct Scene {
    std::int64_t now = 0;                            ///< ns
    const safety::RobotVector* setpoints = nullptr;  ///< from which velocities are integrated, all arms stacked
    const planning::teleoperation::TipPlaces* tips = nullptr;  ///< nullptr: not known
  };

  /// Takes a command whose arms may move. @return false where it is refused; the outcome says why.
  bool take(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept;
  /// Ends what moves an arm, the pair's motion included.
  void end(int arm) noexcept;
  void endAll() noexcept;

  /// Ends streams that fell silent and motions that are done. @return false, with what became of it, as long as there
  /// is something to tell: call again.
  bool reportEnd(const Scene& scene, CrtkOutcome& outcome) noexcept;

  bool active() const noexcept;
  /// The verb that moves a group; CrtkSnapshot::kNone.
  std::uint8_t verb(int group) const noexcept;
  bool movesJoints(int arm) const noexcept { return groups_[at(arm)].verb >= 0 && !groups_[at(arm)].cartesian; }
  /// Some tip is moved.
  bool movesTips() const noexcept;
  /// The group's Cartesian motion involves this arm.
  bool movesTip(int arm) const noexcept;
  /// A motion to one goal is under way.
  bool busy(int arm) const noexcept;

  /// Joint velocities of an arm whose joints are moved, m/s, rad/s.
  safety::ArmVector jointVelocity(int arm, const Scene& scene) noexcept;
  /// The tips' targets go on by one period; the tasks that follow from them.
  void step(const Scene& scene, const planning::Gains& gains, planning::Reference& reference) noexcept;
  void fill(CrtkSnapshot& snapshot) const noexcept;

 private:
  struct Group {
    explicit Group(const planning::teleoperation::GuardOptions& options) : guard(options) {}
    int verb = -1;            ///< none
    int requested_group = 0;  ///< the group that the command was for
    bool cartesian = false;
    std::int64_t fed = 0;  ///< when the last command came, ns
    // Cartesian, m, robot base frame.
    planning::teleoperation::TargetGuard guard;
    Eigen::Vector3d goal = Eigen::Vector3d::Zero(), asked = Eigen::Vector3d::Zero(), speed = Eigen::Vector3d::Zero();
    Eigen::Vector3d held = Eigen::Vector3d::Zero();  ///< pair: where the first arm's tip stays
    double nearest = 0.0;                            ///< to the goal so far
    std::int64_t nearer_at = 0;                      ///< when it last came nearer
  };

  static std::size_t at(int group) noexcept { return static_cast<std::size_t>(group); }
  bool takeTip(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept;
  bool takeJoints(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept;
  safety::ArmVector here(int arm, const Scene& scene) const noexcept {
    return scene.setpoints->segment(robot_.offset(arm), robot_.size(arm));
  }
  Eigen::Vector3d driven(int group, const Scene& scene) const noexcept;
  Eigen::Vector3d wanted(Group& group) const noexcept;
  const char* ending(const Group& group, int index, const Scene& scene, bool& over) noexcept;

  const robots::RobotModel& robot_;
  const planning::teleoperation::GuardOptions& guard_;
  config::Crtk options_;
  double period_, response_, leash_;
  double servo_budget_, interpolate_budget_;  ///< s
  std::vector<Group> groups_;
  std::vector<JointStream> joints_;  ///< of each arm
};

}  // namespace tandem::operation
