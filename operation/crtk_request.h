// SPDX-License-Identifier: Apache-2.0
/** @file CRTK commands as plain structs for the periodic thread: group, verb, values. */
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <string_view>

#include "operation/permission.h"
#include "safety/dimensions.h"

namespace tandem::operation {

enum class CrtkLevel : std::uint8_t { kServo, kInterpolate, kMove, kHold };
enum class CrtkSpace : std::uint8_t { kJoint, kCartesian };
enum class CrtkKind : std::uint8_t { kPosition, kRelative, kVelocity };

/** One command of the CRTK command table. */
struct CrtkVerb {
  std::string_view name;  ///< "servo_cp"
  CrtkLevel level;
  CrtkSpace space;
  CrtkKind kind;
};

/// All commands, in the order of services/dds/topics.h.
inline constexpr std::array kCrtkVerbs{
    CrtkVerb{"servo_jp", CrtkLevel::kServo, CrtkSpace::kJoint, CrtkKind::kPosition},
    CrtkVerb{"servo_jr", CrtkLevel::kServo, CrtkSpace::kJoint, CrtkKind::kRelative},
    CrtkVerb{"servo_jv", CrtkLevel::kServo, CrtkSpace::kJoint, CrtkKind::kVelocity},
    CrtkVerb{"servo_cp", CrtkLevel::kServo, CrtkSpace::kCartesian, CrtkKind::kPosition},
    CrtkVerb{"servo_cr", CrtkLevel::kServo, CrtkSpace::kCartesian, CrtkKind::kRelative},
    CrtkVerb{"servo_cv", CrtkLevel::kServo, CrtkSpace::kCartesian, CrtkKind::kVelocity},
    CrtkVerb{"interpolate_jp", CrtkLevel::kInterpolate, CrtkSpace::kJoint, CrtkKind::kPosition},
    CrtkVerb{"interpolate_jr", CrtkLevel::kInterpolate, CrtkSpace::kJoint, CrtkKind::kRelative},
    CrtkVerb{"interpolate_jv", CrtkLevel::kInterpolate, CrtkSpace::kJoint, CrtkKind::kVelocity},
    CrtkVerb{"interpolate_cp", CrtkLevel::kInterpolate, CrtkSpace::kCartesian, CrtkKind::kPosition},
    CrtkVerb{"interpolate_cr", CrtkLevel::kInterpolate, CrtkSpace::kCartesian, CrtkKind::kRelative},
    CrtkVerb{"interpolate_cv", CrtkLevel::kInterpolate, CrtkSpace::kCartesian, CrtkKind::kVelocity},
    CrtkVerb{"move_jp", CrtkLevel::kMove, CrtkSpace::kJoint, CrtkKind::kPosition},
    CrtkVerb{"move_jr", CrtkLevel::kMove, CrtkSpace::kJoint, CrtkKind::kRelative},
    CrtkVerb{"move_cp", CrtkLevel::kMove, CrtkSpace::kCartesian, CrtkKind::kPosition},
    CrtkVerb{"move_cr", CrtkLevel::kMove, CrtkSpace::kCartesian, CrtkKind::kRelative},
    CrtkVerb{"hold", CrtkLevel::kHold, CrtkSpace::kJoint, CrtkKind::kPosition},
};

/// @param verb index into kCrtkVerbs
inline const CrtkVerb& verbOf(int verb) noexcept { return kCrtkVerbs[static_cast<std::size_t>(verb)]; }

/// Action that a command needs permission for.
constexpr Action actionOf(const CrtkVerb& verb) noexcept {
  if (verb.level == CrtkLevel::kHold)
    return Action::kCrtkHold;
  if (verb.space == CrtkSpace::kCartesian)
    return Action::kCrtkTip;
  return verb.level == CrtkLevel::kMove ? Action::kCrtkMove : Action::kCrtkJoints;
}

/// Groups of commands: the arms, followed by the pair.
inline constexpr int kPairGroup = safety::kMaxArms;
inline constexpr int kCrtkGroups = safety::kMaxArms + 1;

/** A command with all checks that do not depend on the robot's state. */
struct CrtkRequest {
  int verb = 0;   ///< index into kCrtkVerbs
  int group = 0;  ///< arm, or kPairGroup
  int count = 0;  ///< number of values: joints of the group (pair: first arm, then second arm), or 3
  std::array<double, 4> orientation{0.0, 0.0, 0.0, 1.0};      ///< cp, cr: unit quaternion x y z w
  std::array<double, 3> angular{};                            ///< cv: rad/s
  std::array<double, 2 * safety::kMaxJointsPerArm> values{};  ///< m, rad, m/s, rad/s

  // The arms of the group.
  int firstArm() const noexcept { return group == kPairGroup ? 0 : group; }
  int lastArm() const noexcept { return group == kPairGroup ? 1 : group; }
};

/** Result of a command, or later the end of its motion. */
struct CrtkOutcome {
  int verb = 0;
  int group = 0;
  bool counts = true;  ///< false: the command was counted before, and this outcome is the end of its motion
  bool accepted = false;
  std::array<char, 160> reason{};

  template <class... Args>
  CrtkOutcome& refuse(const char* format, Args... args) noexcept {
    accepted = false;
    std::snprintf(reason.data(), reason.size(), format, args...);
    return *this;
  }
};

/// Whether a goal of joints, m and rad, lies inside the limits of its arm; if not, the outcome has the reason.
inline bool isReachable(const safety::ArmVector& goal, const safety::ArmLimits& limits, CrtkOutcome& outcome) noexcept {
  const safety::LimitViolation outside = safety::worstLimitViolation(limits, goal);
  if (outside.amount > kGoalOutside)
    outcome.refuse("the goal of joint %d is %.4g %s outside its limits", outside.joint + 1, 1e3 * outside.amount,
                   limits.isTranslation(outside.joint) ? "mm" : "mrad");
  return outside.amount <= kGoalOutside;
}

/** Snapshot from the periodic thread for the publishing thread. */
struct CrtkSnapshot {
  static constexpr std::uint8_t kNone = 255;
  bool commanding = false;
  std::array<std::uint8_t, kCrtkGroups> active{};  ///< index of the verb that moves the group; kNone
  // Goals: Cartesian ones of each group, m, m/s, rad/s (identity and 0 where orientations are ignored); joint goals of
  // each arm, m and rad.
  std::array<std::uint8_t, kCrtkGroups> has_cp{}, has_cv{};
  std::array<std::array<double, 3>, kCrtkGroups> cp{}, cv{}, cv_angular{};
  std::array<std::array<double, 4>, kCrtkGroups> cp_orientation = identities();  ///< x y z w
  std::array<std::uint8_t, safety::kMaxArms> has_js{};
  std::array<double, safety::kMaxJoints> js{};

  static constexpr std::array<std::array<double, 4>, kCrtkGroups> identities() noexcept {
    std::array<std::array<double, 4>, kCrtkGroups> all{};
    for (std::array<double, 4>& one : all)
      one[3] = 1.0;
    return all;
  }
};

}  // namespace tandem::operation
