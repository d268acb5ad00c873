// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "planning/trajectory.h"

namespace tandem::test {
namespace {

using planning::sample;
using planning::TrajectorySpec;

const Eigen::Vector3d kStart(0.01, -0.02, 0.3), kRelative(0.0, 0.01, 0.0);

TrajectorySpec spec(planning::Shape shape, int points = 100) {
  TrajectorySpec s;
  s.name = "test";
  s.shape = std::move(shape);
  s.point_count = points;
  return s;
}

double largestSpacing(const std::vector<planning::TrajectoryPoint>& points) {
  double worst = (points.front().tip - kStart).norm();
  for (std::size_t i = 1; i < points.size(); ++i)
    worst = std::max(worst, (points[i].tip - points[i - 1].tip).norm());
  return worst;
}

TEST(Shapes, RectangleClosesWithEvenSpacing) {
  const auto points = sample(spec(planning::Rectangle{{-0.02, 0, 0}, {0, 0, 0.02}}), {kStart, kRelative});
  ASSERT_EQ(points.size(), 100u);
  EXPECT_NEAR(largestSpacing(points), 0.8e-3, 1e-12);
  EXPECT_TRUE(points[24].tip.isApprox(kStart + Eigen::Vector3d(-0.02, 0, 0)));
  EXPECT_TRUE(points[49].tip.isApprox(kStart + Eigen::Vector3d(-0.02, 0, 0.02)));
  EXPECT_TRUE(points.back().tip.isApprox(kStart));
  for (const auto& point : points)
    EXPECT_EQ(point.relative, kRelative);
}

TEST(Shapes, LissajousStartsAndEndsAtTheStart) {
  planning::Lissajous shape{{0, 0.01, 0.01}, {0, 1, 2}, {0, 0, 0}};
  const auto points = sample(spec(shape), {kStart, kRelative});
  EXPECT_LT((points.back().tip - kStart).norm(), 1e-12);
  for (const auto& point : points) {
    const Eigen::Vector3d d = point.tip - kStart;
    EXPECT_EQ(d.x(), 0.0);
    // z = 2 y sqrt(1 - (y / a)^2) up to sign, the equation of the figure.
    EXPECT_NEAR(std::abs(d.z()), 2 * std::abs(d.y()) * std::sqrt(1 - d.y() * d.y() / 1e-4), 2e-6);
  }
  EXPECT_NEAR(largestSpacing(points), (points[0].tip - kStart).norm(), 1e-5);
}

TEST(Shapes, CircleKeepsItsRadius) {
  planning::Circle shape{{0.01, 0, 0}, {0, 0, 2}, 1.5};
  const auto points = sample(spec(shape), {kStart, kRelative});
  const Eigen::Vector3d center = kStart + Eigen::Vector3d(0.01, 0, 0);
  for (const auto& point : points)
    EXPECT_NEAR((point.tip - center).norm(), 0.01, 1e-8);
  EXPECT_LT((points.back().tip - (center + Eigen::Vector3d(0.01, 0, 0))).norm(), 1e-9);  // after another half turn
  shape.normal = {1, 0, 0};
  EXPECT_THROW(sample(spec(shape), {kStart, kRelative}), std::invalid_argument);
}

TEST(Shapes, RelativePositionMovesInStep) {
  auto s = spec(planning::Line{{0, 0, 0.01}}, 10);
  s.relative = {planning::Line{{0, 0.002, 0}}};
  const auto points = sample(s, {kStart, kRelative});
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(points[i].relative.isApprox(kRelative + Eigen::Vector3d(0, 0.0002 * (i + 1), 0), 1e-12));
  }
}

TEST(Shapes, WaypointsAreOffsetsUnlessAbsolute) {
  planning::Waypoints shape{{{0.001, 0, 0}, {0.001, 0.002, 0}}, false};
  EXPECT_TRUE(
      sample(spec(shape, 3), {kStart, kRelative}).back().tip.isApprox(kStart + Eigen::Vector3d(0.001, 0.002, 0)));
  shape.absolute = true;
  EXPECT_TRUE(sample(spec(shape, 3), {kStart, kRelative}).back().tip.isApprox(Eigen::Vector3d(0.001, 0.002, 0)));
}

TEST(Shapes, WithoutLengthAreRefused) {
  EXPECT_THROW(sample(spec(planning::Line{}), {kStart, kRelative}), std::invalid_argument);
  EXPECT_THROW(sample(spec(planning::Line{{0, 0, 0.01}}, 0), {kStart, kRelative}), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::test
