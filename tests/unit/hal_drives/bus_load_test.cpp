// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/bus_load.h"

#include <gtest/gtest.h>

#include "tests/unit/safety/random_arm.h"

namespace tandem::hal {
namespace {

/// Cyclic frames only.
BusPlan cyclic(int drives, int encoders, int bytes) {
  BusTraffic traffic;
  traffic.drives = drives;
  traffic.encoders = encoders;
  traffic.command_bytes = traffic.feedback_bytes = bytes;
  traffic.encoder_bytes = 4;
  traffic.heartbeat_period = traffic.master_heartbeat_period = 1e9;
  BusPlan plan;
  plan.streams = streamsOf(traffic);
  return plan;
}

TEST(BusLoad, FrameLengthsOfTheLiterature) {
  // Davis et al. 2007, table of transmission times: 55 bits without data to 135 with eight bytes.
  EXPECT_EQ(frameBits(0), 55);
  EXPECT_EQ(frameBits(4), 95);
  EXPECT_EQ(frameBits(6), 115);
  EXPECT_EQ(frameBits(8), 135);
}

TEST(BusLoad, CyclesOfKnownBuses) {
  // Computed by hand: drives, encoders with 4 bytes, PDO of 6 or 8 bytes, s on a bus with 1 Mbit/s.
  EXPECT_NEAR(computeLoad(cyclic(6, 0, 6)).cycle_time, 1.435e-3, 1e-9);
  EXPECT_NEAR(computeLoad(cyclic(6, 0, 8)).cycle_time, 1.675e-3, 1e-9);
  EXPECT_NEAR(computeLoad(cyclic(6, 6, 6)).cycle_time, 2.005e-3, 1e-9);
  EXPECT_NEAR(computeLoad(cyclic(12, 12, 8)).cycle_time, 4.435e-3, 1e-9);
}

TEST(BusLoad, TheShortestPeriodIsAtTheLimit) {
  for (std::uint32_t run = 0; run < 500; ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    test::Random random(test::baseSeed() + run);
    BusTraffic traffic;
    traffic.drives = random.integer(1, 20);
    traffic.encoders = random.integer(0, 20);
    traffic.heartbeat_period = random.uniform(0.02, 1.0);
    traffic.master_heartbeat_period = random.uniform(0.02, 1.0);
    BusPlan plan;
    plan.bit_rate = random.uniform(5e5, 1e6);
    plan.load_limit = random.uniform(0.3, 0.9);
    plan.streams = streamsOf(traffic);
    plan.period = computeLoad(plan).shortest_period;
    EXPECT_NEAR(computeLoad(plan).load, plan.load_limit, 1e-12);
    plan.period *= 1.001;
    EXPECT_TRUE(computeLoad(plan).fits);
    plan.period /= 1.002;
    EXPECT_FALSE(computeLoad(plan).fits);
  }
}

TEST(BusLoad, ARefusalNamesWhatWouldFit) {
  BusTraffic traffic;
  traffic.drives = traffic.encoders = 12;
  BusPlan plan;
  plan.streams = streamsOf(traffic);
  ASSERT_FALSE(computeLoad(plan).fits);
  const std::string text = explainLoad(plan, traffic);
  EXPECT_NE(text.find("over the limit of 60 %"), std::string::npos) << text;
  // The reported number of axes fits, one more does not.
  const std::size_t at = text.find("at most ");
  ASSERT_NE(at, std::string::npos) << text;
  traffic.drives = traffic.encoders = std::stoi(text.substr(at + 8));
  plan.streams = streamsOf(traffic);
  EXPECT_TRUE(computeLoad(plan).fits);
  ++traffic.drives, ++traffic.encoders;
  plan.streams = streamsOf(traffic);
  EXPECT_FALSE(computeLoad(plan).fits);
}

}  // namespace
}  // namespace tandem::hal
