// SPDX-License-Identifier: Apache-2.0
/** @file Sweeps of an axis: free travel, gearing and following error that a simulated axis has are found again. */
#include "hal/drives/axis_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tandem::hal {
namespace {

/// To and fro twice: with an encoder behind a free travel, a gearing that is wrong by `ratio`, and noise.
std::vector<SweepSample> sweep(std::mt19937& random,
                               double length,
                               double backlash,
                               double ratio,
                               double lag,
                               double noise) {
  std::uniform_real_distribution<double> error(-noise, noise);
  std::vector<SweepSample> samples;
  double encoder = 0.0, setpoint = 0.0;
  const int steps = 120;
  for (int stroke = 0; stroke < 4; ++stroke) {
    const double direction = stroke % 2 == 0 ? 1.0 : -1.0;
    for (int k = 0; k < steps; ++k) {
      setpoint += direction * length / steps;
      SweepSample s;
      s.time = 0.05 * static_cast<double>(samples.size());
      s.setpoint = setpoint;
      s.position = setpoint - direction * lag;
      s.following_error = direction * lag;
      const double driven = ratio * s.position;
      encoder = std::clamp(encoder, driven - 0.5 * backlash, driven + 0.5 * backlash);
      s.encoder_difference = encoder - s.position + error(random);
      samples.push_back(s);
    }
    samples.push_back(samples.back());  // stands
  }
  return samples;
}

TEST(AxisSweep, FindsFreeTravelAndGearing) {
  const auto seed = static_cast<unsigned>(::testing::UnitTest::GetInstance()->random_seed()) + 3u;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int run = 0; run < 100; ++run) {
    const double length = 1e-3 * (1.0 + 4.0 * unit(random));
    const double backlash = 0.2 * length * unit(random), ratio = 0.97 + 0.06 * unit(random);
    const double lag = 0.02 * length * unit(random), noise = 1e-4 * length;
    const SweepResult found = evaluateSweep(sweep(random, length, backlash, ratio, lag, noise));
    SCOPED_TRACE(run);
    EXPECT_NEAR(found.backlash, backlash, 2.0 * noise + 0.07 * 2.0 * length * std::abs(ratio - 1.0) + 1e-9);
    EXPECT_NEAR(found.encoder_ratio, ratio, 2e-3);
    EXPECT_NEAR(found.following_max, lag, 1e-12);
    EXPECT_NEAR(found.following_mean, lag, 1e-12);
    EXPECT_NEAR(found.travel, length, 0.1 * length);
  }
}

TEST(AxisSweep, NamesWhatItCannotDetermine) {
  const SweepResult nothing = evaluateSweep({});
  EXPECT_EQ(nothing.travel, 0.0);
  EXPECT_TRUE(std::isnan(nothing.backlash));
  EXPECT_TRUE(std::isnan(nothing.encoder_ratio));
  // One direction alone has no free travel that could be seen.
  std::vector<SweepSample> there;
  for (int k = 0; k < 50; ++k)
    there.push_back({0.1 * k, 1e-5 * k, 1e-5 * k, 0.0, 0.0});
  EXPECT_TRUE(std::isnan(evaluateSweep(there).backlash));
  EXPECT_NEAR(evaluateSweep(there).encoder_ratio, 1.0, 1e-12);
}

}  // namespace
}  // namespace tandem::hal
