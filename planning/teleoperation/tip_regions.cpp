// SPDX-License-Identifier: Apache-2.0
#include "planning/teleoperation/tip_regions.h"

#include <algorithm>

namespace tandem::planning::teleoperation {
namespace {

using Eigen::Vector3d;

/// Rounding of a distance, m.
constexpr double kTiny = 1e-9;

}  // namespace

double responseTime(const GuardOptions& options, double period) noexcept {
  return std::max(options.response, 2.0 * period);
}

double leashOf(double leash, double max_speed, double response) noexcept {
  return std::max(leash, 1.5 * max_speed * response);
}

double leashOf(const GuardOptions& options, double period) noexcept {
  return leashOf(options.leash, options.max_speed, responseTime(options, period));
}

/// Moves all tips out to the margin, or to their present distance if that is smaller. If regions leave no room between
/// them, the last target remains.
Vector3d TipRegions::outOfRegions(Vector3d x,
                                  const Vector3d& target,
                                  const DrivenTips& tips,
                                  StageResult& stage) const noexcept {
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    bool good = true;
    for (std::size_t r = 0; r < options_->forbidden.size(); ++r) {
      const ForbiddenRegion& region = options_->forbidden[r];
      for (std::size_t i = 0; i < static_cast<std::size_t>(tips.count); ++i) {
        const double bound = std::min(options_->margin, distance(region, tips.place(i, target)));
        const Vector3d tip = tips.place(i, x);
        const double missing = bound - distance(region, tip);
        if (missing <= kTiny)
          continue;
        x += tips.sign[i] * missing * outward(region, tip);
        stage.limiter = Limiter::kForbiddenRegion;
        stage.index = static_cast<int>(r);
        good = false;
      }
    }
    if (good)
      return x;
  }
  return target;
}

Vector3d TipRegions::intoWorkspace(Vector3d x,
                                   const Vector3d& target,
                                   const DrivenTips& tips,
                                   StageResult& stage) const noexcept {
  if (!options_->workspace)
    return x;
  for (std::size_t i = 0; i < static_cast<std::size_t>(tips.count); ++i) {
    const Vector3d last = tips.place(i, target), tip = tips.place(i, x);
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = std::min(options_->workspace->minimum[axis], last[axis]);
      const double upper = std::max(options_->workspace->maximum[axis], last[axis]);
      const double inside = std::clamp(tip[axis], lower, upper);
      if (inside == tip[axis])
        continue;
      stage.limiter = Limiter::kWorkspace;
      stage.index = 2 * axis + (tip[axis] > inside ? 1 : 0);
      x[axis] += tips.sign[i] * (inside - tip[axis]);
    }
  }
  return x;
}

/// Fraction of the straight line from every tip to its position at the target `to` that keeps this margin, or its
/// present distance if that is smaller.
double TipRegions::clearShare(const DrivenTips& from, const Vector3d& to, double margin, int& region) const noexcept {
  double share = 1.0;
  for (std::size_t r = 0; r < options_->forbidden.size(); ++r) {
    const ForbiddenRegion& forbidden = options_->forbidden[r];
    for (std::size_t i = 0; i < static_cast<std::size_t>(from.count); ++i) {
      const Vector3d start = from.tip[i], end = from.place(i, to);
      const double here = distance(forbidden, start);
      const double bound = std::min(margin, here) - kTiny;
      // The distance changes no faster than the position: most lines need no search.
      if (here + distance(forbidden, end) - (end - start).norm() >= 2.0 * bound)
        continue;
      const auto clear = [&](double t) { return nearestOnWay(forbidden, start, start + t * (end - start)) >= bound; };
      if (clear(share))
        continue;
      region = static_cast<int>(r);
      double good = 0.0, bad = share;
      for (int round = 0; round < 14; ++round) {
        const double middle = 0.5 * (good + bad);
        (clear(middle) ? good : bad) = middle;
      }
      share = good;
    }
  }
  return share;
}

Vector3d TipRegions::confined(const Vector3d& wanted,
                              const Vector3d& target,
                              const DrivenTips& tips,
                              GuardResult& result) const noexcept {
  Vector3d x = wanted;
  result.fixture.input = x;
  if (options_->guidance) {
    const Vector3d led = target + guided(*options_->guidance, target, wanted - target);
    if (!led.isApprox(x, 1e-12)) {
      result.fixture.limiter = Limiter::kGuidance;
      x = led;
    }
  }
  x = outOfRegions(x, target, tips, result.fixture);
  result.fixture.output = result.workspace.input = x;
  x = intoWorkspace(x, target, tips, result.workspace);
  result.workspace.output = x;
  return x;
}

/// Half and a quarter of the margin leave room for chords of a path along a surface.
Vector3d TipRegions::clear(const Vector3d& x,
                           const Vector3d& target,
                           const Vector3d& now,
                           const DrivenTips& tips,
                           GuardResult& result) const noexcept {
  int region = -1;
  DrivenTips here = tips;
  for (std::size_t i = 0; i < static_cast<std::size_t>(tips.count); ++i)
    here.tip[i] = tips.place(i, target);
  Vector3d to = target + clearShare(here, x, 0.5 * options_->margin, region) * (x - target);
  if (const double share = clearShare(tips, to, 0.25 * options_->margin, region); share < 1.0)
    to = now + share * (to - now);
  if (region >= 0) {
    result.fixture.limiter = Limiter::kForbiddenRegion;
    result.fixture.index = region;
  }
  return to;
}

}  // namespace tandem::planning::teleoperation
