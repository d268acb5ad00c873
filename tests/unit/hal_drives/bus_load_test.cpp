// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/bus_load.h"

#include "hal/drives/cyclic_objects.h"

#include <gtest/gtest.h>

#include "tests/unit/safety/random_arm.h"

namespace tandem::hal {
namespace {

/// Drives with one PDO of so many bytes in each direction.
BusTraffic trafficOf(int drives, int encoders, std::size_t bytes = 6) {
  BusTraffic traffic;
  traffic.drives = drives;
  traffic.encoders = encoders;
  traffic.commands[bytes] = traffic.feedback[bytes] = drives;
  return traffic;
}

/// Cyclic frames only.
BusPlan cyclic(int drives, int encoders, std::size_t bytes) {
  BusTraffic traffic = trafficOf(drives, encoders, bytes);
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

TEST(BusLoad, BitsOfManyFramesAreTheSumOfTheirs) {
  test::Random random(test::baseSeed());
  std::uint64_t frames = 0, bytes = 0, bits = 0;
  for (int k = 0; k < 1000; ++k) {
    const int data = random.integer(0, 8);
    ++frames;
    bytes += static_cast<std::uint64_t>(data);
    bits += static_cast<std::uint64_t>(frameBits(data));
    ASSERT_EQ(trafficBits(frames, bytes), static_cast<double>(bits));
  }
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
    BusTraffic traffic = trafficOf(random.integer(1, 20), random.integer(0, 20));
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
  BusTraffic traffic = trafficOf(12, 12);
  BusPlan plan;
  plan.streams = streamsOf(traffic);
  ASSERT_FALSE(computeLoad(plan).fits);
  const std::string text = explainLoad(plan, traffic);
  EXPECT_NE(text.find("over the limit of 60 %"), std::string::npos) << text;
  // The reported number of axes fits, one more does not.
  const std::size_t at = text.find("at most ");
  ASSERT_NE(at, std::string::npos) << text;
  const int most = std::stoi(text.substr(at + 8));
  traffic = trafficOf(most, most);
  plan.streams = streamsOf(traffic);
  EXPECT_TRUE(computeLoad(plan).fits);
  traffic = trafficOf(most + 1, most + 1);
  plan.streams = streamsOf(traffic);
  EXPECT_FALSE(computeLoad(plan).fits);
}

/// Every object is in one PDO, in order; a PDO has neither more bytes than a frame nor more objects than the drive
/// takes, and no two neighbours fit into one.
TEST(PackedPdos, AreFullAndNoFuller) {
  for (std::uint32_t run = 0; run < 500; ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    test::Random random(test::baseSeed() + run);
    const int most = random.integer(1, 8);
    std::vector<CyclicObject> objects(static_cast<std::size_t>(random.integer(0, 8)));
    for (std::size_t k = 0; k < objects.size(); ++k)
      objects[k] = {static_cast<std::uint16_t>(0x6000 + k), 0, 8 << random.integer(0, 2)};
    const auto bits = [](const std::vector<CyclicObject>& pdo) {
      int sum = 0;
      for (const CyclicObject& object : pdo)
        sum += object.bits;
      return sum;
    };
    std::size_t next = 0;
    int total = 0;
    std::array<double, 9> frames{};
    countFrames(frames, objects, most);
    const auto pdos = packPdos(objects, most);
    for (std::size_t k = 0; k < pdos.size(); ++k) {
      EXPECT_GE(pdos[k].size(), 1u);
      EXPECT_LE(pdos[k].size(), static_cast<std::size_t>(most));
      EXPECT_LE(bits(pdos[k]), 64);
      total += bits(pdos[k]);
      for (const CyclicObject& object : pdos[k])
        EXPECT_EQ(object.index, 0x6000 + next++);
      if (k > 0) {
        EXPECT_TRUE(static_cast<int>(pdos[k - 1].size()) == most || bits(pdos[k - 1]) + pdos[k][0].bits > 64);
      }
    }
    EXPECT_EQ(next, objects.size());
    double bytes = 0.0;
    for (std::size_t n = 0; n < frames.size(); ++n)
      bytes += static_cast<double>(n) * frames[n];
    EXPECT_EQ(bytes, total / 8);
  }
}

}  // namespace
}  // namespace tandem::hal
