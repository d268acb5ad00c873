// SPDX-License-Identifier: Apache-2.0
/** @file Simulated tip tracker: measures the plant's tips at a rate, with noise, bias, distortion, delay and drop-outs.
 */
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/plant_tips.h"
#include "sim/random_stream.h"

namespace tandem::sim {

/** One measurement of all tips. */
struct TipMeasurement {
  std::uint64_t sequence = 0;  ///< number of the measurement, from 1, drop-outs included
  std::int64_t stamp = 0;      ///< time of the measurement, ns on the caller's clock
  std::uint64_t mark = 0;      ///< value of the caller for that time
  std::array<bool, safety::kMaxArms> valid{};
  std::array<Eigen::Vector3d, safety::kMaxArms> position;  ///< m, robot base frame
  /// robot base frame <- tool tip frame; zero from a tracker without orientations
  std::array<Eigen::Quaterniond, safety::kMaxArms> orientation;
};

/** Tip tracker.
 *
 * A measured position is p + bias + d(p) + noise, a measured orientation noise * bias * R. The distortion d depends
 * smoothly on the position, as that of an electromagnetic tracker near metal:
 *
 *   d_x(p) = D (sin(k p_y + a_x) + sin(k p_z + b_x)) / 2,   k = 2 pi / period,
 *
 * and likewise for y (z, x) and z (x, y), with phases a, b from the seed: no axis exceeds D. The delay of a measurement
 * is delay + U, U uniform in [0, delay_variation); none arrives before an earlier one. Nothing after construction
 * allocates; the same seed gives the same measurements after every restart. */
class TipTracker {
 public:
  TipTracker(int arm_count, const TipTrackerOptions& options, std::uint64_t seed);

  /// The robot is at standstill, for longer than the delay: makes a measurement of all arms that arrives at once.
  void restart(const PlantTips& tips, std::int64_t now, std::uint64_t mark) noexcept;
  /// Advances to `now`, ns: makes at most one measurement that is due, and delivers those that have arrived.
  /// @param mark value stored with the measurement
  /// @return true if latest() is new.
  bool step(const PlantTips& tips, std::int64_t now, std::uint64_t mark) noexcept;
  /// d at a position, m.
  Eigen::Vector3d distortion(const Eigen::Vector3d& position) const noexcept;
  /// The newest measurement that has arrived.
  const TipMeasurement& latest() const noexcept { return latest_; }

 private:
  void measure(const PlantTips& tips,
               std::int64_t now,
               std::uint64_t mark,
               double drop_out,
               TipMeasurement& result) noexcept;

  /** A measurement on its way. */
  struct UnderWay {
    TipMeasurement measurement;
    std::int64_t arrival = 0;  ///< ns
  };

  TipTrackerOptions options_;
  Eigen::Quaterniond rotation_bias_;
  int arm_count_;
  RandomStream random_, delays_;
  Eigen::Matrix<double, 3, 2> phase_;
  std::int64_t start_ = 0;           ///< of the first measurement, ns
  std::int64_t taken_ = 0;           ///< number of due measurements so far, the first one not counted
  std::uint64_t sequence_ = 0;       ///< of the last measurement made
  std::vector<UnderWay> under_way_;  ///< ring, oldest first
  std::size_t first_ = 0, count_ = 0;
  TipMeasurement latest_;
};

}  // namespace tandem::sim
