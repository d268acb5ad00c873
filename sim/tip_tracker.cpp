// SPDX-License-Identifier: Apache-2.0
#include "sim/tip_tracker.h"

#include <cmath>
#include <stdexcept>

namespace tandem::sim {
namespace {

/// Tolerance for rounding of the due time, as a share of the period.
constexpr double kDue = 1e-6;

Eigen::Quaterniond rotation(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0.0)
    return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle));
}

}  // namespace

TipTracker::TipTracker(int arm_count, const TipTrackerOptions& options, std::uint64_t seed)
    : options_(options), arm_count_(arm_count), random_(seed, Noise::kTracker, 0) {
  if (!(options.rate > 0.0) || !(options.delay >= 0.0))
    throw std::invalid_argument("tip tracker: the rate must be above zero, the delay not below");
  under_way_.resize(static_cast<std::size_t>(std::ceil(options.delay * options.rate)) + 2);
}

void TipTracker::restart(const PlantTips& tips, std::int64_t now, std::uint64_t mark) noexcept {
  random_.restart();
  start_ = now;
  taken_ = 0;
  first_ = count_ = 0;
  measure(tips, now, mark, 0.0, latest_);
}

void TipTracker::measure(const PlantTips& tips,
                         std::int64_t now,
                         std::uint64_t mark,
                         double drop_out,
                         TipMeasurement& m) noexcept {
  m.sequence = ++sequence_;
  m.stamp = now;
  m.mark = mark;
  for (int k = 0; k < arm_count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    // All numbers are always drawn: the noise of one arm does not depend on another arm.
    const Eigen::Vector3d shift = options_.position_noise * random_.normal3();
    const Eigen::Vector3d turn = options_.rotation_noise * random_.normal3();
    const bool dropped = random_.uniform() < drop_out;
    m.valid[i] = tips.valid(k) && !dropped;
    m.position[i] = tips.pose(k).translation() + shift;
    m.orientation[i] = rotation(turn) * Eigen::Quaterniond(tips.pose(k).linear());
  }
}

bool TipTracker::step(const PlantTips& tips, std::int64_t now, std::uint64_t mark) noexcept {
  const auto due =
      static_cast<std::int64_t>(std::floor(1e-9 * static_cast<double>(now - start_) * options_.rate + kDue));
  if (due > taken_) {
    taken_ = due;
    // The ring is full only if the caller's clock jumped: the oldest measurement is lost then.
    if (count_ == under_way_.size()) {
      first_ = (first_ + 1) % under_way_.size();
      --count_;
    }
    measure(tips, now, mark, options_.drop_out, under_way_[(first_ + count_) % under_way_.size()]);
    ++count_;
  }
  const auto delay = static_cast<std::int64_t>(std::llround(1e9 * options_.delay));
  bool arrived = false;
  while (count_ > 0 && under_way_[first_].stamp + delay <= now) {
    latest_ = under_way_[first_];
    first_ = (first_ + 1) % under_way_.size();
    --count_;
    arrived = true;
  }
  return arrived;
}

}  // namespace tandem::sim
