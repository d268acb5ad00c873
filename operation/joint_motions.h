// SPDX-License-Identifier: Apache-2.0
/** @file Motions of single arms in joint space: to a goal, jog, withdrawal. */
#pragma once

#include "operation/crtk_request.h"
#include "operation/drive_exchange.h"
#include "operation/withdrawal.h"
#include "safety/joint_motion.h"

namespace tandem::operation {

/** At most one motion of each arm, and whether arms are homed. Nothing allocates after construction, locks or throws.
 */
class JointMotions {
 public:
  /// Keeps `drives` by reference.
  JointMotions(const ControlSetup& setup, const DriveExchange& drives);

  // Each replaces what moves the arm, and goes on from DriveExchange::setpoints().
  /// @param goal  inside the limits, m, rad
  void moveTo(int arm, const safety::ArmVector& goal) noexcept;
  /// CRTK's move_jp and move_jr, for an arm or for two. @return false where a goal is outside; the outcome says so
  bool take(const CrtkRequest& request, CrtkOutcome& outcome) noexcept;
  void home(int arm) noexcept;
  /// @param velocity  m/s, rad/s; ends by itself, unless it is repeated within its budget
  void jog(int arm, const safety::ArmVector& velocity, std::int64_t now) noexcept;
  void withdraw(int arm) noexcept;
  void end(int arm) noexcept { at(arm).kind = Kind::kNone; }

  double jogTime() const noexcept { return 1e-9 * static_cast<double>(jog_time_); }  ///< for which a jog lasts, s
  bool active(int arm) const noexcept { return at(arm).kind != Kind::kNone; }
  bool anyActive() const noexcept;
  /// It ends by itself.
  bool busy(int arm) const noexcept { return active(arm) && at(arm).kind != Kind::kJog; }
  /// A CRTK command moves it.
  bool byCrtk(int arm) const noexcept { return at(arm).kind == Kind::kGoal && at(arm).verb != CrtkSnapshot::kNone; }
  /// Home counts as forgotten until the next home().
  void unhome(int arm) noexcept { at(arm).unhomed = true; }
  bool homed(int arm) const noexcept {
    return !at(arm).unhomed && drives_.state().homed[static_cast<std::size_t>(arm)] != 0;
  }
  bool homing(int arm) const noexcept { return at(arm).kind == Kind::kGoal && at(arm).homing; }

  /// The next velocities of an arm with a motion. @param recovering  only as fast as joints are recovered
  void step(int arm, bool recovering, std::int64_t now, Velocities& velocities) noexcept;
  void fill(CrtkSnapshot& snapshot) const noexcept;

 private:
  enum class Kind : std::uint8_t { kNone, kGoal, kJog, kWithdraw };
  struct Arm {
    Kind kind = Kind::kNone;
    safety::JointMotion motion;
    double time = 0.0;  ///< s since its start
    bool homing = false, unhomed = false;
    std::uint8_t verb = CrtkSnapshot::kNone, group = 0;
    safety::ArmVector jog_velocity;
    std::int64_t jog_until = 0;  ///< ns
    WithdrawalRun withdrawal;
  };
  const Arm& at(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)]; }
  Arm& at(int arm) noexcept { return arms_[static_cast<std::size_t>(arm)]; }
  safety::ArmVector towardGoal(int arm) noexcept;
  safety::ArmVector jogged(int arm, bool recovering) const noexcept;
  bool arrived(int arm) const noexcept;

  ControlSetup setup_;
  const DriveExchange& drives_;
  std::int64_t jog_time_;  ///< for which a jog lasts, ns
  std::array<Arm, safety::kMaxArms> arms_;
};

}  // namespace tandem::operation
