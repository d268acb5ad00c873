// SPDX-License-Identifier: Apache-2.0
/** @file Limits on tip targets: virtual fixtures, workspace, speed, and largest distance ahead of the tip. */
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "planning/teleoperation/regions.h"

namespace tandem::planning::teleoperation {

/** What bounds targets of operators and CRTK clients. */
struct GuardOptions {
  std::vector<ForbiddenRegion> forbidden;
  double margin = 1e-3;  ///< distance that targets keep from them, m
  std::optional<Guidance> guidance;
  std::optional<Box> workspace;  ///< that targets of tips stay in
  double max_speed = 20e-3;      ///< of targets, m/s
  double leash = 3e-3;           ///< farthest that a target is ahead of the tip, m
  double response = 0.05;        ///< in which a tip reaches its target, s; two control periods where these are longer
};

/** What in a stage changed its input. */
enum class Limiter : std::uint8_t {
  kNone = 0,
  kForbiddenRegion,  ///< StageResult::index says which
  kGuidance,
  kWorkspace,  ///< index: 0 to 5 for x_min, x_max, y_min, y_max, z_min, z_max
  kSpeed,
  kLeash,
  kDeadband,
  kDeadMan,
  kClutch,
  kScale,
};

/** What one stage did in one cycle. */
struct StageResult {
  Eigen::Vector3d input = Eigen::Vector3d::Zero();
  Eigen::Vector3d output = Eigen::Vector3d::Zero();
  Limiter limiter = Limiter::kNone;
  int index = 0;
};

/** The tips that move with what is driven: each one is at offset + sign * (where what is driven is). */
struct DrivenTips {
  int count = 0;
  std::array<int, 2> arm{};
  std::array<Eigen::Vector3d, 2> offset{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};  ///< m
  std::array<Eigen::Vector3d, 2> tip{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};     ///< where it is, m
  std::array<double, 2> sign{1.0, 1.0};

  void add(int k, const Eigen::Vector3d& from_driven, const Eigen::Vector3d& now, double direction = 1.0) noexcept {
    const auto i = static_cast<std::size_t>(count++);
    arm[i] = k;
    offset[i] = from_driven;
    tip[i] = now;
    sign[i] = direction;
  }
  /// Where tip i is when what is driven is at x.
  Eigen::Vector3d place(std::size_t i, const Eigen::Vector3d& x) const noexcept { return offset[i] + sign[i] * x; }
};

/** Lets a target move from where it is toward where it is wanted as far as that is allowed.
 *
 * Neither targets nor the straight way of each tip to its target enter a forbidden region. A tip that is inside of one
 * already, or outside of the workspace, may only move out. Nothing after construction allocates or throws. */
class TargetGuard {
 public:
  explicit TargetGuard(const GuardOptions& options) : options_(&options) {}

  /// The target is here, m, robot base frame: where what is driven is.
  void engage(const Eigen::Vector3d& x) noexcept { target_ = x; }

  struct Result {
    StageResult fixture, workspace, rate, reach;
  };
  /// @param wanted  m; @param now  where what is driven is, m; @param leash  largest distance between target and now, m
  const Result& step(const Eigen::Vector3d& wanted,
                     const Eigen::Vector3d& now,
                     const DrivenTips& tips,
                     double leash,
                     double dt) noexcept;

  const Eigen::Vector3d& target() const noexcept { return target_; }

 private:
  Eigen::Vector3d outOfRegions(Eigen::Vector3d x, const DrivenTips& tips, StageResult& stage) const noexcept;
  Eigen::Vector3d intoWorkspace(Eigen::Vector3d x, const DrivenTips& tips, StageResult& stage) const noexcept;
  double clearShare(const DrivenTips& from, const Eigen::Vector3d& to, double margin, int& region) const noexcept;

  const GuardOptions* options_;
  Eigen::Vector3d target_ = Eigen::Vector3d::Zero();
  Result result_;
};

/// How fast tips follow targets at a control period, s: the time in which the distance shrinks to 1/e.
double responseTime(const GuardOptions& options, double period) noexcept;
/// Leash that lets targets move at full speed at that period, m.
double leashOf(const GuardOptions& options, double period) noexcept;

}  // namespace tandem::planning::teleoperation
