// SPDX-License-Identifier: Apache-2.0
/** @file Filter and virtual fixtures alone. */
#include <gtest/gtest.h>

#include <numbers>

#include "planning/teleoperation/one_euro.h"
#include "planning/teleoperation/regions.h"
#include "tests/unit/planning/dice.h"

namespace tandem::test {
namespace {

using namespace planning::teleoperation;
using Eigen::Vector3d;

TEST(Teleoperation, GuidanceWeakensWhatLeadsAwayAndNothingElse) {
  overSeeds([](Dice& dice) {
    const Guidance guidance{{{0, 0, 0}, {0.1, 0, 0}}, dice.uniform(0.0, 1.0), 0.01};
    const Vector3d from(dice.uniform(0.01, 0.09), dice.uniform(-0.006, 0.006), 0.0);
    const Vector3d d = dice.ball(1e-3);
    const Vector3d led = guided(guidance, from, d);
    EXPECT_NEAR(led.x(), d.x(), 1e-12);
    EXPECT_NEAR(led.z(), (1.0 - guidance.strength) * d.z(), 1e-12);
    const bool away = from.y() * d.y() > 0.0;
    if (away) {
      EXPECT_NEAR(led.y(), (1.0 - guidance.strength) * d.y(), 1e-12);
    } else if (std::abs(d.y()) < std::abs(from.y())) {
      EXPECT_NEAR(led.y(), d.y(), 1e-12);
    }
    const Vector3d far(0.05, 0.02, 0.0);
    EXPECT_EQ(guided(guidance, far, d), d);
  });
}

TEST(OneEuro, QuietAtRestAndQuickInMotion) {
  const double dt = 0.01;
  const OneEuroOptions options;
  overSeeds([&](Dice& dice) {
    OneEuro<Positions> still(options);
    still.reset(Vector3d::Zero());
    double raw = 0.0, filtered = 0.0;
    for (int i = 0; i < 500; ++i) {
      const Vector3d noise = dice.ball(1e-4);
      raw += noise.squaredNorm();
      filtered += still.step(noise, dt).squaredNorm();
    }
    EXPECT_LT(filtered, 0.25 * raw);
    OneEuro<Positions> quick(options);
    quick.reset(Vector3d::Zero());
    const double speed = 0.1;
    double lag = 0.0;
    for (int i = 1; i <= 500; ++i) {
      const Vector3d x(speed * dt * i, 0.0, 0.0);
      lag = (x - quick.step(x, dt)).norm() / speed;
    }
    // A first-order low-pass at f_c lags by 1 / (2 pi f_c), minus one sample.
    EXPECT_LT(lag, 1.0 / (2.0 * std::numbers::pi * (options.min_cutoff + 0.9 * options.beta * speed)));
  });
}

TEST(Regions, TheNearestPlaceOnAWayIsTheNearest) {
  overSeeds([](Dice& dice) {
    for (const auto& shape :
         {std::variant<Sphere, HalfSpace, Box>(Sphere{dice.ball(1.0), 0.5}),
          std::variant<Sphere, HalfSpace, Box>(HalfSpace{dice.ball(1.0), dice.ball(1.0).normalized()}),
          std::variant<Sphere, HalfSpace, Box>(Box{{-0.5, -0.3, -0.1}, {0.2, 0.3, 0.4}})}) {
      const ForbiddenRegion region{"r", shape};
      const Vector3d a = dice.ball(2.0), b = dice.ball(2.0);
      double nearest = 1e9;
      for (int i = 0; i <= 2000; ++i)
        nearest = std::min(nearest, distance(region, a + i / 2000.0 * (b - a)));
      EXPECT_NEAR(nearestOnWay(region, a, b), nearest, 2e-3);
      EXPECT_LE(nearestOnWay(region, a, b), nearest + 1e-5 * (b - a).norm());
      // Along the outward direction the distance grows as much as the position changes.
      const Vector3d p = dice.ball(2.0), n = outward(region, p);
      EXPECT_NEAR(n.norm(), 1.0, 1e-12);
      EXPECT_NEAR(distance(region, p + 1e-7 * n) - distance(region, p), 1e-7, 1e-9);
    }
  });
}

}  // namespace
}  // namespace tandem::test
