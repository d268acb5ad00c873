// SPDX-License-Identifier: Apache-2.0
/** @file Bounds on tip positions: virtual fixtures and workspace. */
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "planning/teleoperation/regions.h"
#include "planning/teleoperation/target_guard.h"

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

/** Bounds of positions for TargetGuard.
 *
 * Neither targets nor the straight line from each tip to its target enter a forbidden region. A tip already inside one,
 * or outside of the workspace, may only move out. All positions are m, robot base frame. */
class TipRegions {
 public:
  using Space = Positions;
  using Body = DrivenTips;

  /// @param options  must outlive this
  explicit TipRegions(const GuardOptions& options) : options_(&options) {}

  const Positions& space() const noexcept { return space_; }
  double maxSpeed() const noexcept { return options_->max_speed; }
  /// The wanted position after guidance, outside of forbidden regions, in the workspace.
  Eigen::Vector3d confined(const Eigen::Vector3d& wanted,
                           const Eigen::Vector3d& target,
                           const DrivenTips& tips,
                           GuardResult& result) const noexcept;
  /// Final guarantee, independent of the stages before: neither the target's path to x nor the tips' lines to it cross
  /// a forbidden region.
  Eigen::Vector3d clear(const Eigen::Vector3d& x,
                        const Eigen::Vector3d& target,
                        const Eigen::Vector3d& now,
                        const DrivenTips& tips,
                        GuardResult& result) const noexcept;

 private:
  Eigen::Vector3d outOfRegions(Eigen::Vector3d x,
                               const Eigen::Vector3d& target,
                               const DrivenTips& tips,
                               StageResult& stage) const noexcept;
  Eigen::Vector3d intoWorkspace(Eigen::Vector3d x,
                                const Eigen::Vector3d& target,
                                const DrivenTips& tips,
                                StageResult& stage) const noexcept;
  double clearShare(const DrivenTips& from, const Eigen::Vector3d& to, double margin, int& region) const noexcept;

  const GuardOptions* options_;
  Positions space_;
};

using PositionGuard = TargetGuard<TipRegions>;

/// Time constant of tips following targets at a control period, s: the distance decreases to 1/e.
double responseTime(const GuardOptions& options, double period) noexcept;
/// Leash that allows targets to move at full speed at that period, m.
double leashOf(const GuardOptions& options, double period) noexcept;
/// The same for other speeds and leashes, m or rad. @param response  responseTime(), s
double leashOf(double leash, double max_speed, double response) noexcept;

}  // namespace tandem::planning::teleoperation
