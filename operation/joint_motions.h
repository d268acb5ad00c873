// SPDX-License-Identifier: Apache-2.0
/** @file Motions of single arms in joint space: to a goal, jog, withdrawal. */
#pragma once

#include "operation/crtk_request.h"
#include "operation/drive_exchange.h"
#include "operation/withdrawal.h"
#include "safety/joint_motion.h"

namespace tandem::operation {

/** At most one motion per arm, and their homing states. Nothing allocates after construction, locks or throws. */
class JointMotions {
 public:
  /// Keeps `drives` by reference.
  JointMotions(const ControlSetup& setup, const DriveExchange& drives);

  // Each replaces the present motion of the arm and starts from DriveExchange::setpoints().
  /// @param goal  inside the limits, m, rad
  void moveTo(int arm, const safety::ArmVector& goal) noexcept;
  /// CRTK's move_jp and move_jr, for one or two arms. @return false if a goal is outside the limits; the outcome has
  /// the reason
  bool take(const CrtkRequest& request, CrtkOutcome& outcome) noexcept;
  void home(int arm) noexcept;
  /// @param velocity  m/s, rad/s; the jog ends by itself unless it is repeated within its budget
  void jog(int arm, const safety::ArmVector& velocity, std::int64_t now) noexcept;
  void withdraw(int arm) noexcept;
  void end(int arm) noexcept { at(arm).kind = Kind::kNone; }

  double jogTime() const noexcept { return 1e-9 * static_cast<double>(jog_time_); }  ///< of an unrepeated jog, s
  bool active(int arm) const noexcept { return at(arm).kind != Kind::kNone; }
  bool anyActive() const noexcept;
  /// The arm has a motion that ends by itself.
  bool busy(int arm) const noexcept { return active(arm) && at(arm).kind != Kind::kJog; }
  /// A CRTK command moves the arm.
  bool byCrtk(int arm) const noexcept { return at(arm).kind == Kind::kGoal && at(arm).verb != CrtkSnapshot::kNone; }
  /// The arm counts as not homed until the next home().
  void unhome(int arm) noexcept { at(arm).unhomed = true; }
  bool homed(int arm) const noexcept {
    return !at(arm).unhomed && drives_.state().homed[static_cast<std::size_t>(arm)] != 0;
  }
  bool homing(int arm) const noexcept { return at(arm).kind == Kind::kGoal && at(arm).homing; }

  /// Next velocities of an arm with a motion. @param recovering  limits a jog to recovery speeds
  void step(int arm, bool recovering, std::int64_t now, Velocities& velocities) noexcept;
  void fill(CrtkSnapshot& snapshot) const noexcept;

 private:
  enum class Kind : std::uint8_t { kNone, kGoal, kJog, kWithdraw };
  struct Arm {
    Kind kind = Kind::kNone;
    safety::JointMotion motion;
    double time = 0.0;  ///< since its start, s
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
  std::int64_t jog_time_;  ///< duration of a jog without repetition, ns
  std::array<Arm, safety::kMaxArms> arms_;
};

}  // namespace tandem::operation
