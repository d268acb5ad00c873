// SPDX-License-Identifier: Apache-2.0
/** @file CRTK motions of the arms and of the pair: tip targets and joint velocities in each cycle.
 * For the periodic thread; nothing here allocates, locks or throws after construction. */
#pragma once

#include <vector>

#include "operation/cartesian_motion.h"
#include "operation/joint_stream.h"

namespace tandem::operation {

/** Streams and Cartesian motions; joint motions to one goal (move_jp, move_jr) belong to JointMotions.
 *
 * Each arm is a group, moved by its joints or by its tip. The pair of the first two arms is another group with x_AB,
 * tip of the first arm minus tip of the second. While the pair moves, the tip of the first arm holds or follows its own
 * Cartesian command, and the second arm moves to satisfy x_AB; a Cartesian command to the second arm ends the pair's,
 * and vice versa. */
class CrtkMotion {
 public:
  explicit CrtkMotion(const ControlSetup& setup);

  /** State of the robot for one cycle. */
  struct Scene {
    std::int64_t now = 0;                                      ///< ns
    const safety::RobotVector* setpoints = nullptr;            ///< of all arms, start of integration
    const planning::teleoperation::TipPlaces* tips = nullptr;  ///< nullptr: unknown
  };

  /// Takes a command whose arms may move. @return false if it is refused; the outcome has the reason.
  bool take(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept;
  /// Ends the motion of an arm, including the pair's motion.
  void end(int arm) noexcept;
  void endAll() noexcept;

  /// Ends streams that have timed out and motions that are finished. @return false, with the outcome, as long as there
  /// is an end to report: call again.
  bool reportEnd(const Scene& scene, CrtkOutcome& outcome) noexcept;

  bool active() const noexcept;
  /// Index of the verb that moves a group, or CrtkSnapshot::kNone.
  std::uint8_t verb(int group) const noexcept;
  bool movesJoints(int arm) const noexcept { return groups_[at(arm)].verb >= 0 && !groups_[at(arm)].cartesian; }
  /// At least one tip is moved.
  bool movesTips() const noexcept;
  /// The group's Cartesian motion involves this arm.
  bool movesTip(int arm) const noexcept;
  /// A motion to one goal is running.
  bool busy(int arm) const noexcept;

  /// Joint velocities of an arm whose joints are moved, m/s, rad/s.
  safety::ArmVector jointVelocity(int arm, const Scene& scene) noexcept;
  /// Advances the targets of the tips by one period and writes the tasks for them.
  void step(const Scene& scene, const planning::Gains& gains, planning::Reference& reference) noexcept;
  void fill(CrtkSnapshot& snapshot) const noexcept;

 private:
  struct Group {
    Group(const ControlSetup& setup, bool pair) : motion(setup, pair) {}
    int verb = -1;            ///< index into kCrtkVerbs; -1: none
    int requested_group = 0;  ///< the group that the command was for
    bool cartesian = false;
    std::int64_t fed = 0;  ///< time of the last command, ns
    CartesianMotion motion;
    Eigen::Vector3d held = Eigen::Vector3d::Zero();  ///< pair: fixed position of the first arm's tip, m
  };

  static std::size_t at(int group) noexcept { return static_cast<std::size_t>(group); }
  bool takeTip(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept;
  bool takeJoints(const CrtkRequest& request, const Scene& scene, CrtkOutcome& outcome) noexcept;
  safety::ArmVector here(int arm, const Scene& scene) const noexcept {
    return scene.setpoints->segment(robot_.offset(arm), robot_.size(arm));
  }
  kinematics::TaskPlace driven(int group, const Scene& scene) const noexcept;
  int tasksBeside(int group) const noexcept;
  const char* ending(Group& group, int index, const Scene& scene, bool& over) noexcept;

  const robots::RobotModel& robot_;
  double servo_budget_, interpolate_budget_;  ///< s
  std::vector<Group> groups_;
  std::vector<JointStream> joints_;  ///< of each arm
};

}  // namespace tandem::operation
