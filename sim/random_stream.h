// SPDX-License-Identifier: Apache-2.0
/** @file Seeded random numbers: one stream per source of noise, so that the sources are independent. */
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace tandem::sim {

/** Purpose of a stream of random numbers. */
enum class Noise : std::uint32_t { kEncoder = 1, kTubes, kTracker, kTrackerDelay, kTrackerDistortion };

/** Stream that depends only on the seed, the purpose and the index. Drawing allocates nothing. */
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, Noise purpose, int index) : seed_(seed), purpose_(purpose), index_(index) {
    restart();
  }

  /// Restarts the stream at its first number.
  void restart() noexcept {
    // Two rounds of SplitMix64: neighbouring seeds and indices give independent streams.
    const std::uint64_t source = static_cast<std::uint64_t>(purpose_) << 32 | static_cast<std::uint32_t>(index_);
    engine_.seed(mixed(mixed(seed_) ^ source));
    normal_.reset();
  }

  /// Mean 0, standard deviation 1.
  double normal() { return normal_(engine_); }
  Eigen::Vector3d normal3() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }
  /// In [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

 private:
  static constexpr std::uint64_t mixed(std::uint64_t x) noexcept {
    x += 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
  }

  std::uint64_t seed_;
  Noise purpose_;
  int index_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace tandem::sim
