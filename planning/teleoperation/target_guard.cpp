// SPDX-License-Identifier: Apache-2.0
#include "planning/teleoperation/target_guard.h"

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

double leashOf(const GuardOptions& options, double period) noexcept {
  return std::max(options.leash, 1.5 * options.max_speed * responseTime(options, period));
}

/// Moves all tips out to the margin, or to their present distance if that is smaller. If regions leave no room between
/// them, the last target remains.
Vector3d TargetGuard::outOfRegions(Vector3d x, const DrivenTips& tips, StageResult& stage) const noexcept {
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    bool good = true;
    for (std::size_t r = 0; r < options_->forbidden.size(); ++r) {
      const ForbiddenRegion& region = options_->forbidden[r];
      for (std::size_t i = 0; i < static_cast<std::size_t>(tips.count); ++i) {
        const double bound = std::min(options_->margin, distance(region, tips.place(i, target_)));
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
  return target_;
}

Vector3d TargetGuard::intoWorkspace(Vector3d x, const DrivenTips& tips, StageResult& stage) const noexcept {
  if (!options_->workspace)
    return x;
  for (std::size_t i = 0; i < static_cast<std::size_t>(tips.count); ++i) {
    const Vector3d last = tips.place(i, target_), tip = tips.place(i, x);
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
double TargetGuard::clearShare(const DrivenTips& from, const Vector3d& to, double margin, int& region) const noexcept {
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

const TargetGuard::Result& TargetGuard::step(const Vector3d& wanted,
                                             const Vector3d& now,
                                             const DrivenTips& tips,
                                             double leash,
                                             double dt) noexcept {
  result_ = {};
  Vector3d x = wanted;
  result_.fixture.input = x;
  if (options_->guidance) {
    const Vector3d led = target_ + guided(*options_->guidance, target_, wanted - target_);
    if (!led.isApprox(x, 1e-12)) {
      result_.fixture.limiter = Limiter::kGuidance;
      x = led;
    }
  }
  x = outOfRegions(x, tips, result_.fixture);
  result_.fixture.output = result_.workspace.input = x;
  x = intoWorkspace(x, tips, result_.workspace);
  result_.workspace.output = result_.rate.input = x;

  const double step = (x - target_).norm(), most = options_->max_speed * dt;
  if (step > most) {
    x = target_ + (most / step) * (x - target_);
    result_.rate.limiter = Limiter::kSpeed;
  }
  result_.rate.output = result_.reach.input = x;

  if (const double ahead = (x - now).norm(); ahead > leash) {
    x = now + (leash / ahead) * (x - now);
    result_.reach.limiter = Limiter::kLeash;
  }
  // Final guarantee, independent of the steps before: neither the target's path nor the tips' lines to it cross a
  // forbidden region. Half and a quarter of the margin leave room for chords of a path along a surface.
  int region = -1;
  DrivenTips here = tips;
  for (std::size_t i = 0; i < static_cast<std::size_t>(tips.count); ++i)
    here.tip[i] = tips.place(i, target_);
  x = target_ + clearShare(here, x, 0.5 * options_->margin, region) * (x - target_);
  if (const double share = clearShare(tips, x, 0.25 * options_->margin, region); share < 1.0)
    x = now + share * (x - now);
  if (region >= 0) {
    result_.fixture.limiter = Limiter::kForbiddenRegion;
    result_.fixture.index = region;
  }
  result_.reach.output = x;
  target_ = x;
  return result_;
}

}  // namespace tandem::planning::teleoperation
