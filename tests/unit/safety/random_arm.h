// SPDX-License-Identifier: Apache-2.0
/** @file Random tube arms, joint vectors inside their limits, and the seed they come from. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>

#include "safety/limits.h"

namespace tandem::test {

/// Seed of the random tests; TANDEM_TEST_SEED overrides it, failures print it.
inline std::uint32_t baseSeed() {
  const char* text = std::getenv("TANDEM_TEST_SEED");
  return text != nullptr ? static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10)) : 20240607u;
}

/// Number of cases of a random test: `usual`, times TANDEM_TEST_CASES if that is set.
inline std::uint32_t cases(std::uint32_t usual) {
  const char* text = std::getenv("TANDEM_TEST_CASES");
  return text != nullptr ? usual * static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10)) : usual;
}

/** Random numbers of one case. */
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double uniform(double lower, double upper) { return std::uniform_real_distribution<double>(lower, upper)(engine_); }
  int integer(int lower, int upper) { return std::uniform_int_distribution<int>(lower, upper)(engine_); }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }

 private:
  std::mt19937 engine_;
};

inline std::string trace(std::uint32_t seed) { return "seed " + std::to_string(seed) + " (set TANDEM_TEST_SEED)"; }

/// Limits of an arm of 2 to 4 tubes with random lengths, margins, stages and speeds.
inline safety::ArmLimits randomLimits(Random& random) {
  const int n = random.integer(2, 4);
  safety::TubeLimitSpec spec;
  spec.tube_length.assign(n, 0.0);
  double length = random.uniform(0.05, 0.2);
  for (int i = n; i-- > 0; length += random.uniform(0.03, 0.15))
    spec.tube_length[i] = length;
  for (int i = 0; i + 1 < n; ++i) {
    spec.carriage_spacing.push_back(random.chance(0.3) ? 0.0 : random.uniform(0.0, 0.01));
    spec.minimum_extension.push_back(random.chance(0.3) ? 0.0 : random.uniform(0.0, 0.01));
  }
  for (int i = 0; i < n; ++i) {
    spec.stage_minimum.push_back(-spec.tube_length[i] * random.uniform(0.9, 1.1));
    spec.stage_maximum.push_back(0.0);
  }
  spec.translation.velocity = random.uniform(0.005, 0.05);
  spec.translation.stop_deceleration = random.uniform(0.05, 0.2);
  spec.rotation.velocity = random.uniform(0.2, 3.0);
  spec.rotation.stop_deceleration = random.uniform(5.0, 20.0);
  if (random.chance(0.7)) {
    spec.rotation.lower = -random.uniform(1.0, 6.0);
    spec.rotation.upper = random.uniform(1.0, 6.0);
  }
  try {
    return safety::makeTubeLimits(spec);
  } catch (const std::invalid_argument&) {
    return randomLimits(random);  // the stages leave no range
  }
}

/// A joint vector inside the limits; every third one is at a limit of each tube.
inline safety::ArmVector randomInside(const safety::ArmLimits& limits, Random& random) {
  const int n = limits.jointCount() / 2;
  safety::ArmVector q = safety::ArmVector::Zero(2 * n);
  const bool at_limits = random.chance(0.33);
  for (int i = 0; i < n; ++i) {
    double lower = limits.joints[i].lower;
    double upper = limits.joints[i].upper;
    if (i > 0) {
      lower = std::max(lower, q[i - 1] - limits.rows[2 * i - 2].b);
      upper = std::min(upper, q[i - 1] + limits.rows[2 * i - 1].b);
    }
    if (lower > upper)
      return randomInside(limits, random);
    q[i] = at_limits ? (random.chance(0.5) ? lower : upper) : random.uniform(lower, upper);
    q[n + i] = random.uniform(std::max(-3.0, limits.joints[n + i].lower), std::min(3.0, limits.joints[n + i].upper));
  }
  // Rounding may put a point at a limit outside of it.
  return safety::largestViolation(limits, q) <= 0.0 ? q : randomInside(limits, random);
}

/// A random joint vector, mostly far outside.
inline safety::ArmVector randomWild(const safety::ArmLimits& limits, const safety::ArmVector& q, Random& random) {
  const double scale = std::pow(10.0, random.uniform(-6.0, 1.0));
  safety::ArmVector wild = q;
  for (Eigen::Index j = 0; j < limits.jointCount(); ++j) {
    if (!random.chance(0.2))
      wild[j] += scale * random.uniform(-1.0, 1.0);
  }
  return wild;
}

}  // namespace tandem::test
