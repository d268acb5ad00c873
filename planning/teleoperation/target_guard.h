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

/** Bounds on targets of operators and CRTK clients. */
struct GuardOptions {
  std::vector<ForbiddenRegion> forbidden;
  double margin = 1e-3;  ///< minimum distance between targets and forbidden regions, m
  std::optional<Guidance> guidance;
  std::optional<Box> workspace;  ///< bounds of tip targets
  double max_speed = 20e-3;      ///< of targets, m/s
  double leash = 3e-3;           ///< largest distance of a target ahead of the tip, m
  double response = 0.05;        ///< response time of a tip to its target, s; at least two control periods
};

/** Limiter that changed the input of a stage. */
enum class Limiter : std::uint8_t {
  kNone = 0,
  kForbiddenRegion,  ///< region in StageResult::index
  kGuidance,
  kWorkspace,  ///< index: 0 to 5 for x_min, x_max, y_min, y_max, z_min, z_max
  kSpeed,
  kLeash,
  kDeadband,
  kDeadMan,
  kClutch,
  kScale,
};

/** Result of one stage in one cycle. */
struct StageResult {
  Eigen::Vector3d input = Eigen::Vector3d::Zero();
  Eigen::Vector3d output = Eigen::Vector3d::Zero();
  Limiter limiter = Limiter::kNone;
  int index = 0;
};

/** Tips that move with the driven point x: tip i is at offset + sign * x. */
struct DrivenTips {
  int count = 0;
  std::array<int, 2> arm{};
  std::array<Eigen::Vector3d, 2> offset{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};  ///< m
  std::array<Eigen::Vector3d, 2> tip{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};     ///< present position, m
  std::array<double, 2> sign{1.0, 1.0};

  void add(int k, const Eigen::Vector3d& from_driven, const Eigen::Vector3d& now, double direction = 1.0) noexcept {
    const auto i = static_cast<std::size_t>(count++);
    arm[i] = k;
    offset[i] = from_driven;
    tip[i] = now;
    sign[i] = direction;
  }
  /// Position of tip i with the driven point at x.
  Eigen::Vector3d place(std::size_t i, const Eigen::Vector3d& x) const noexcept { return offset[i] + sign[i] * x; }
};

/** Moves a target from its present to its wanted position as far as allowed.
 *
 * Neither targets nor the straight line from each tip to its target enter a forbidden region. A tip already inside one,
 * or outside of the workspace, may only move out. Nothing after construction allocates or throws. */
class TargetGuard {
 public:
  explicit TargetGuard(const GuardOptions& options) : options_(&options) {}

  /// Sets the target to the driven point, m, robot base frame.
  void engage(const Eigen::Vector3d& x) noexcept { target_ = x; }

  struct Result {
    StageResult fixture, workspace, rate, reach;
  };
  /// @param wanted  m; @param now  the driven point, m; @param leash  largest distance between target and now, m
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

/// Time constant of tips following targets at a control period, s: the distance decreases to 1/e.
double responseTime(const GuardOptions& options, double period) noexcept;
/// Leash that allows targets to move at full speed at that period, m.
double leashOf(const GuardOptions& options, double period) noexcept;

}  // namespace tandem::planning::teleoperation
