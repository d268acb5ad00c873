// SPDX-License-Identifier: Apache-2.0
#include "kinematics/determinant_track.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <random>
#include <string>

namespace tandem::kinematics {
namespace {

template <int kSize>
using Square = Eigen::Matrix<double, kSize, kSize>;

/// A random rotation of this dimension.
template <int kSize>
Square<kSize> rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Square<kSize> any = Square<kSize>::NullaryExpr([&] { return normal(random); });
  Square<kSize> q = Eigen::HouseholderQR<Square<kSize>>(any).householderQ();
  if (q.determinant() < 0.0)
    q.col(0) = -q.col(0);
  return q;
}

/// det Z = x (x - 2 lowest) from its zero at x = 0: Z is singular there, in any of its columns.
template <int kSize>
void beginsAtASingularPlace(double lowest, bool turned, std::mt19937& random) {
  using Track = DeterminantTrack<double, kSize>;
  const int column = std::uniform_int_distribution<int>(0, kSize - 1)(random);
  const Square<kSize> left = turned ? rotation<kSize>(random) : Square<kSize>::Identity();
  const Square<kSize> right = turned ? rotation<kSize>(random) : Square<kSize>::Identity();
  const auto at = [&](double x) {
    Square<kSize> z = Square<kSize>::Identity(), slope = Square<kSize>::Zero();
    z(column, column) = x * (x - 2.0 * lowest);
    slope(column, column) = 2.0 * (x - lowest);
    return typename Track::Place{left * z * right, left * slope * right};
  };
  SCOPED_TRACE("size " + std::to_string(kSize) + ", lowest at " + std::to_string(lowest));
  Track track(0.3);
  track.add(0.3, 0.1, at(0.0), at(1.0), at);
  if (lowest > 0.0) {
    EXPECT_NEAR(track.minimum(), -lowest * lowest, 1e-12);
    EXPECT_NEAR(track.at(), 0.3 - 0.2 * lowest, 1e-8);
  } else {
    EXPECT_NEAR(track.minimum(), std::min(1.0, 1.0 - 2.0 * lowest), 1e-12) << "it rises all the way";
  }
}

TEST(DeterminantTrack, FindsTheMinimumOfAPieceThatBeginsAtASingularPlace) {
  constexpr unsigned kSeed = 28;
  std::mt19937 random(kSeed);
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  for (int run = 0; run < 200; ++run) {
    const double lowest = std::uniform_real_distribution<double>(0.05, 0.6)(random) * (run % 4 < 2 ? 1.0 : -1.0);
    const bool turned = run % 2 == 1;  // otherwise the column is exactly zero, and elimination has no pivot for it
    beginsAtASingularPlace<4>(lowest, turned, random);
    beginsAtASingularPlace<6>(lowest, turned, random);
  }
}

}  // namespace
}  // namespace tandem::kinematics
