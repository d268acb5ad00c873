// SPDX-License-Identifier: Apache-2.0
/** @file Random numbers with a seed that is reported on failure. */
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>
#include <random>
#include <string>

namespace tandem::test {

struct Dice {
  explicit Dice(unsigned seed) : engine(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
  bool chance(double p) { return uniform(0.0, 1.0) < p; }
  Eigen::Vector3d ball(double size) { return size * Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)); }
  Eigen::Quaterniond turn() {
    std::normal_distribution<double> n;
    return Eigen::Quaterniond(n(engine), n(engine), n(engine), n(engine)).normalized();
  }
  std::mt19937 engine;
};

inline constexpr int kRuns = 60;

inline void overSeeds(const std::function<void(Dice&)>& body) {
  const unsigned base = std::random_device{}();
  for (unsigned run = 0; run < kRuns && !testing::Test::HasFailure(); ++run) {
    SCOPED_TRACE("seed " + std::to_string(base + run));
    Dice dice(base + run);
    body(dice);
  }
}

}  // namespace tandem::test
