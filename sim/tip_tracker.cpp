// SPDX-License-Identifier: Apache-2.0
#include "sim/tip_tracker.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "kinematics/rotations.h"

namespace tandem::sim {
namespace {

/// Tolerance for rounding of the due time, as a share of the period.
constexpr double kDue = 1e-6;

}  // namespace

TipTracker::TipTracker(int arm_count, const TipTrackerOptions& options, std::uint64_t seed)
    : options_(options),
      rotation_bias_(kinematics::rotationBy(options.rotation_bias)),
      arm_count_(arm_count),
      random_(seed, Noise::kTracker, 0),
      delays_(seed, Noise::kTrackerDelay, 0) {
  if (!(options.rate > 0.0) || !(options.delay >= 0.0) || !(options.delay_variation >= 0.0))
    throw std::invalid_argument("tip tracker: found a rate of " + std::to_string(options.rate) + " Hz, a delay of " +
                                std::to_string(options.delay) + " s and a delay variation of " +
                                std::to_string(options.delay_variation) +
                                " s, expected a rate above zero and the others not below");
  if (!(options.distortion_period > 0.0))
    throw std::invalid_argument("tip tracker: found a distortion period of " +
                                std::to_string(options.distortion_period) + " m, expected more than 0 m");
  under_way_.resize(static_cast<std::size_t>(std::ceil((options.delay + options.delay_variation) * options.rate)) + 2);
  RandomStream phases(seed, Noise::kTrackerDistortion, 0);
  for (int axis = 0; axis < 3; ++axis) {
    for (int term = 0; term < 2; ++term)
      phase_(axis, term) = 2.0 * std::numbers::pi * phases.uniform();
  }
}

Eigen::Vector3d TipTracker::distortion(const Eigen::Vector3d& position) const noexcept {
  const Eigen::Vector3d angle = 2.0 * std::numbers::pi / options_.distortion_period * position;
  Eigen::Vector3d error;
  for (int axis = 0; axis < 3; ++axis) {
    const double first = std::sin(angle[(axis + 1) % 3] + phase_(axis, 0));
    const double second = std::sin(angle[(axis + 2) % 3] + phase_(axis, 1));
    error[axis] = 0.5 * options_.distortion * (first + second);
  }
  return error;
}

void TipTracker::restart(const PlantTips& tips, std::int64_t now, std::uint64_t mark) noexcept {
  random_.restart();
  delays_.restart();
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
    m.position[i] = tips.pose(k).translation() + options_.bias + distortion(tips.pose(k).translation()) + shift;
    m.orientation[i] = Eigen::Quaterniond(0.0, 0.0, 0.0, 0.0);
    if (options_.orientations)
      m.orientation[i] = kinematics::rotationBy(turn) * rotation_bias_ * Eigen::Quaterniond(tips.pose(k).linear());
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
    UnderWay& next = under_way_[(first_ + count_) % under_way_.size()];
    measure(tips, now, mark, options_.drop_out, next.measurement);
    const double delay = options_.delay + options_.delay_variation * delays_.uniform();
    next.arrival = now + static_cast<std::int64_t>(std::llround(1e9 * delay));
    ++count_;
  }
  bool arrived = false;
  while (count_ > 0 && under_way_[first_].arrival <= now) {
    latest_ = under_way_[first_].measurement;
    first_ = (first_ + 1) % under_way_.size();
    --count_;
    arrived = true;
  }
  return arrived;
}

}  // namespace tandem::sim
