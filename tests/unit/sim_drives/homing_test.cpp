// SPDX-License-Identifier: Apache-2.0
/** @file Homing methods of the simulated drive against the table of CiA 402-2, over random places of start and
 * switches. */
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "sim/drives/drive.h"
#include "tests/unit/safety/random_arm.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::sim::drives {
namespace {

using test::DriveRig;
using test::kControl;

constexpr std::uint16_t kReached = 0x0400, kAttained = 0x1000, kError = 0x2000;
constexpr double kLow = -40e3, kHigh = 40e3;  // mechanical ends, with the limit switches before them, counts
constexpr double kFast = 60e3, kSlow = 4e3, kAcceleration = 2e6;
constexpr double kOvershoot = kFast * kFast / (2.0 * kAcceleration) + 400.0;  // of the ramp and of the motor's lag

enum class Edge { kNegativeLimit, kPositiveLimit, kLeft, kRight };

/** What CiA 402-2 says of a method: the edge, the direction in which it is crossed at the end, the direction of the
 * search while the switch is inactive. */
struct Expected {
  Edge edge;
  int final;
  int search;
};
const std::map<int, Expected> kExpected{
    {17, {Edge::kNegativeLimit, 1, -1}}, {18, {Edge::kPositiveLimit, -1, 1}}, {19, {Edge::kLeft, -1, 1}},
    {20, {Edge::kLeft, 1, 1}},           {21, {Edge::kRight, 1, -1}},         {22, {Edge::kRight, -1, -1}},
    {23, {Edge::kLeft, -1, 1}},          {24, {Edge::kLeft, 1, 1}},           {25, {Edge::kRight, -1, 1}},
    {26, {Edge::kRight, 1, 1}},          {27, {Edge::kRight, 1, -1}},         {28, {Edge::kRight, -1, -1}},
    {29, {Edge::kLeft, 1, -1}},          {30, {Edge::kLeft, -1, -1}}};

/** One drive in homing mode, with switches. */
struct Bench {
  Bench(int method, double start, const Switches& switches, double low = kLow, double high = kHigh)
      : Bench(method, spec(start, switches, low, high)) {}
  Bench(int method, const BusSpec& bus) : rig(bus) {
    auto setup = test::driveSetup(1, 6);
    setup.steps.push_back(hal::canopen::write({0x6098, 0}, method, 1, "method"));
    setup.steps.push_back(hal::canopen::write({0x6099, 1}, std::llround(kFast), 4, "fast"));
    setup.steps.push_back(hal::canopen::write({0x6099, 2}, std::llround(kSlow), 4, "slow"));
    setup.steps.push_back(hal::canopen::write({0x609A, 0}, std::llround(kAcceleration), 4, "acceleration"));
    setup.steps.push_back(hal::canopen::write({0x607C, 0}, 0, 4, "home offset"));
    rig.network.addNode(setup);
    ready = rig.ready();
  }
  static BusSpec spec(double start, const Switches& switches, double low, double high) {
    BusSpec spec = test::rigSpec(1, false);
    spec.drives[0].start = start;
    spec.drives[0].incremental = true;
    spec.drives[0].motor.low = low;
    spec.drives[0].motor.high = high;
    spec.drives[0].switches = switches;
    return spec;
  }
  double position() { return rig.drive().motor().position(); }
  /// Zero of the drive's counter, in the motor's counts.
  double reference() { return position() - rig.drive().position(); }
  /// Runs the method; notes the first direction and the direction in which the reference was set.
  bool home() {
    const double start = position(), zero = reference();
    rig.command().set(kControl, 0x1F);
    double before = start;
    for (int k = 0; k < 6000 && (rig.status() & (kAttained | kError)) == 0; ++k) {
      rig.cycle();
      if (first == 0 && std::abs(position() - start) > 2.0)
        first = position() > start ? 1 : -1;
      if (position() != before && std::abs(reference() - zero) < 0.5)
        last = position() > before ? 1 : -1;
      before = position();
    }
    rig.run(0.3);
    return (rig.status() & (kAttained | kReached | kError)) == (kAttained | kReached);
  }
  bool failed() { return (rig.status() & (kAttained | kError)) == kError; }

  DriveRig rig;
  bool ready = false;
  int first = 0, last = 0;
};

/// Limit switches at +-30e3; a home switch that suits the method.
Switches randomSwitches(int method, test::Random& random) {
  Switches switches;
  switches.negative = random.uniform(-34e3, -30e3);
  switches.positive = random.uniform(30e3, 34e3);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double a = random.uniform(-20e3, 10e3), width = random.uniform(500.0, 10e3);
  switches.home_from = method == 21 || method == 22 ? -kInfinity : a;
  switches.home_to = method == 19 || method == 20 ? kInfinity : a + width;
  switches.index = random.uniform(0.0, 4096.0);
  return switches;
}

double placeOf(Edge edge, const Switches& switches) {
  switch (edge) {
    case Edge::kNegativeLimit:
      return *switches.negative;
    case Edge::kPositiveLimit:
      return *switches.positive;
    case Edge::kLeft:
      return switches.home_from;
    case Edge::kRight:
      break;
  }
  return switches.home_to;
}

bool activeAt(Edge edge, const Switches& switches, double position) {
  return edge == Edge::kNegativeLimit   ? switches.negativeAt(position)
         : edge == Edge::kPositiveLimit ? switches.positiveAt(position)
                                        : switches.homeAt(position);
}

TEST(HomingMethods, EndAtTheRightEdgeAndMoveTowardsTheSwitchThatTheyName) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 20; ++seed) {
    for (const auto& [method, expected] : kExpected) {
      SCOPED_TRACE(test::trace(seed) + ", method " + std::to_string(method));
      test::Random random(seed * 100 + static_cast<std::uint32_t>(method));
      const Switches switches = randomSwitches(method, random);
      const double start = random.uniform(*switches.negative - 2e3, *switches.positive + 2e3);
      const double edge = placeOf(expected.edge, switches);
      SCOPED_TRACE("start " + std::to_string(start) + ", edge " + std::to_string(edge));
      Bench bench(method, start, switches);
      ASSERT_TRUE(bench.ready);
      ASSERT_TRUE(bench.home());
      // A switch may be too narrow to slow down on it: then one step of the physics at full speed.
      const bool narrow = switches.home_to - switches.home_from < kOvershoot;
      EXPECT_NEAR(bench.reference(), edge, narrow ? 1e-9 * kFast * DriveBus::kStep + 1.0 : 3.0);
      const bool active = activeAt(expected.edge, switches, start);
      // On the switch it leaves it, on the side of the edge.
      const int side = expected.edge == Edge::kNegativeLimit || expected.edge == Edge::kRight ? 1 : -1;
      // It turns at once if it already stands on the limit switch of its search.
      const bool at_limit =
          !active && method >= 23 && (expected.search < 0 ? switches.negativeAt(start) : switches.positiveAt(start));
      EXPECT_EQ(bench.first, active ? side : at_limit ? -expected.search : expected.search);
      EXPECT_EQ(bench.last, expected.final);
      const DriveRecord& record = bench.rig.drive().record();
      const bool turns =
          method >= 23 && !active && (expected.search > 0 ? start > switches.home_to : start < switches.home_from);
      const double limit = expected.search > 0 ? *switches.positive : *switches.negative;
      const double width =
          std::isfinite(switches.home_to - switches.home_from) ? switches.home_to - switches.home_from : 0.0;
      const double most = (turns ? std::abs(limit - start) + std::abs(limit - edge) : std::abs(edge - start)) +
                          2.0 * width + 4.0 * kOvershoot;
      EXPECT_LE(record.travel, most);
    }
  }
}

TEST(HomingMethods, WithIndexPulseEndAtTheFirstOneBehindTheEdge) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 2; ++seed) {
    for (int method = 1; method <= 14; ++method) {
      SCOPED_TRACE(test::trace(seed) + ", method " + std::to_string(method));
      test::Random random(seed * 100 + static_cast<std::uint32_t>(method));
      const Expected& expected = kExpected.at(method + 16);
      Switches switches = randomSwitches(method + 16, random);
      if (std::isfinite(switches.home_to))
        switches.home_to += 5e3;  // room for a revolution inside
      Bench bench(method, random.uniform(-29e3, 29e3), switches);
      ASSERT_TRUE(bench.ready);
      ASSERT_TRUE(bench.home());
      const double edge = placeOf(expected.edge, switches);
      const double behind = expected.final * (bench.reference() - edge);
      EXPECT_GE(behind, -3.0);
      EXPECT_LE(behind, 4096.0 + 3.0);
      EXPECT_NEAR(std::remainder(bench.reference() - switches.index, 4096.0), 0.0, 3.0);
      EXPECT_EQ(bench.last, expected.final);
    }
  }
}

TEST(HomingMethods, IndexPulseAndPresentPosition) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 4; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    Switches switches;
    switches.index = random.uniform(0.0, 4096.0);
    const double start = random.uniform(-20e3, 20e3);
    for (const int direction : {-1, 1}) {
      Bench bench(direction < 0 ? 33 : 34, start, switches);
      ASSERT_TRUE(bench.home());
      const double travel = direction * (bench.reference() - start);
      EXPECT_GE(travel, -3.0);
      EXPECT_LE(travel, 4096.0 + 3.0);
      EXPECT_NEAR(std::remainder(bench.reference() - switches.index, 4096.0), 0.0, 3.0);
    }
    for (const int method : {35, 37}) {
      Bench bench(method, start, switches);
      ASSERT_TRUE(bench.home());
      EXPECT_NEAR(bench.reference(), start, 1.0);
      EXPECT_EQ(bench.rig.drive().record().travel, 0.0) << "no motion";
    }
  }
}

TEST(HomingMethods, FailWhenTheSwitchIsAbsent) {
  for (const auto& [method, expected] : kExpected) {
    SCOPED_TRACE(method);
    Switches none;
    none.at_ends = false;
    Bench bench(method, 0.0, none);
    EXPECT_FALSE(bench.home());
    EXPECT_TRUE(bench.failed());
    EXPECT_EQ(bench.rig.drive().record().travel, 0.0) << "the drive knows that the input has no switch";
    if (expected.edge == Edge::kNegativeLimit || expected.edge == Edge::kPositiveLimit)
      continue;
    // Fitted but never active: beyond the limit switches.
    Switches broken;
    broken.negative = -10e3;
    broken.positive = 10e3;
    broken.home_from = 500e3;
    broken.home_to = 501e3;
    Bench searching(method, 0.0, broken);
    EXPECT_FALSE(searching.home());
    EXPECT_TRUE(searching.failed());
    EXPECT_LE(std::abs(searching.position()), 10e3 + kOvershoot);
    EXPECT_EQ(searching.rig.drive().record().faults, 0u);
  }
}

TEST(HomingMethods, FailAtAMechanicalEndWithoutItsSwitch) {
  for (const int method : {19, 22, 34}) {
    SCOPED_TRACE(method);
    Switches switches;
    switches.at_ends = false;
    switches.home_from = method == 22 ? -500e3 : 400e3;
    switches.home_to = method == 22 ? -400e3 : 500e3;
    switches.index = 2000.0;
    Bench bench(method, 0.0, switches, -1500.0, 1500.0);
    EXPECT_FALSE(bench.home());
    EXPECT_TRUE(bench.failed());
  }
}

/// Numbers of a manufacturer, as a profile describes them: the reference is a stop, or the first index pulse behind it.
TEST(HomingMethods, OfAManufacturerEndAtTheMechanicalStop) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 4; ++seed) {
    test::Random random(seed);
    for (const int direction : {-1, 1}) {
      for (const bool index : {false, true}) {
        SCOPED_TRACE(test::trace(seed) + ", direction " + std::to_string(direction) + (index ? ", index" : ""));
        Switches switches;
        switches.at_ends = false;
        switches.index = random.uniform(0.0, 4096.0);
        const double stop = direction * random.uniform(10e3, 20e3);
        BusSpec bus =
            Bench::spec(random.uniform(-9e3, 9e3), switches, direction < 0 ? stop : kLow, direction > 0 ? stop : kHigh);
        const int method = random.integer(-128, -1);
        bus.drives[0].stop_number = method;
        bus.drives[0].stop_method = HomingMethod::toStop(direction, index);
        Bench bench(method, bus);
        ASSERT_TRUE(bench.ready);
        ASSERT_TRUE(bench.home());
        EXPECT_EQ(bench.first, direction);
        const double behind = direction * (stop - bench.reference());
        EXPECT_GE(behind, -3.0);
        EXPECT_LE(behind, index ? 4096.0 + 3.0 : 3.0);
        if (index) {
          EXPECT_NEAR(std::remainder(bench.reference() - switches.index, 4096.0), 0.0, 3.0);
        }
        EXPECT_EQ(bench.rig.drive().state(), DriveState::kEnabled) << "no following error at the stop";
      }
    }
  }
}

TEST(HomingMethods, ReservedNumbersAreRefused) {
  using hal::canopen::SdoAbort;
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  for (int method = -128; method <= 127; ++method) {
    const bool known = (method >= 1 && method <= 14) || (method >= 17 && method <= 30) ||
                       (method >= 33 && method <= 35) || method == 37;
    EXPECT_EQ(rig.write(0, {0x6098, 0}, method, 1) == SdoAbort::kNone, known) << method;
  }
}

}  // namespace
}  // namespace tandem::sim::drives
