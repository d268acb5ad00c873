// SPDX-License-Identifier: Apache-2.0
/** @file Which samples a client with a limited rate receives. */
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "services/console/decimation.h"
#include "services/dds/raw.h"

namespace tandem::console {
namespace {

constexpr std::uint64_t kMillisecond = 1'000'000;  // ns
constexpr std::uint64_t kStart = 1'700'000'000'000 * kMillisecond;

/** A random stream at 1 kHz: a wave with noise and rare spikes as the first peak value, rare events. */
struct Stream {
  explicit Stream(std::mt19937& random) {
    std::uniform_real_distribution<double> unit;
    for (std::uint64_t k = 0; k < 2000; ++k) {
      SampleFeatures features;
      events += random() % 300 == 0;
      features.events = events;
      const double wave = 1.0 + 0.5 * std::sin(0.01 * static_cast<double>(k)) + 0.02 * unit(random);
      features.peaks[0] = {random() % 50 == 0 ? wave * (1.0 + 4.0 * unit(random)) : wave, 0.01};
      features.peaks[5] = {random() % 100 == 0 ? 1.0 : 0.0, 0.1};
      samples.push_back({std::make_shared<const std::string>(std::to_string(k)), kStart + k * kMillisecond});
      all.push_back(features);
    }
  }
  std::vector<HubSample> samples;
  std::vector<SampleFeatures> all;
  std::uint64_t events = 0;
};

std::size_t indexOf(const HubSample& sample) { return std::stoul(*sample.bytes); }

TEST(DecimationRules, OneSampleAnIntervalWithEveryEventAndPeak) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 20; ++round) {
    const Stream stream(random);
    const std::uint64_t interval = (2 + random() % 60) * kMillisecond;
    Decimation decimation(interval);
    std::vector<std::size_t> sent;
    std::vector<std::size_t> regular;  // by the interval or an event, not as a peak
    for (std::size_t k = 0; k < stream.samples.size(); ++k) {
      const auto selected = decimation.take(stream.samples[k], stream.all[k]);
      if (!selected.empty()) {
        EXPECT_EQ(indexOf(selected.back()), k) << "the newest comes last";
        regular.push_back(k);
      }
      for (const HubSample& sample : selected)
        sent.push_back(indexOf(sample));
      const bool event = k > 0 && stream.all[k].events != stream.all[k - 1].events;
      EXPECT_TRUE(!event || !selected.empty()) << "an event waits for nothing";
    }
    EXPECT_TRUE(std::is_sorted(sent.begin(), sent.end()));
    EXPECT_EQ(std::adjacent_find(sent.begin(), sent.end()), sent.end()) << "each once";
    EXPECT_LE(regular.size(), 2000 * kMillisecond / interval + 2 + stream.events);
    EXPECT_GE(regular.size(), 2000 * kMillisecond / interval);
    for (std::size_t i = 1; i < regular.size(); ++i) {
      const std::size_t from = regular[i - 1], to = regular[i];
      for (std::size_t peak : {0, 5}) {
        const auto value = [&](std::size_t k) { return stream.all[k].peaks[peak].value; };
        double highest = 1.1 * std::max(value(from), value(to)) + stream.all[from].peaks[peak].resolution;
        for (auto k = std::lower_bound(sent.begin(), sent.end(), from); *k < to; ++k)
          highest = std::max(highest, value(*k));
        for (std::size_t k = from + 1; k < to; ++k)
          EXPECT_LE(value(k), highest) << "a visible peak at " << k << " is not sent";
      }
    }
  }
}

TEST(DecimationRules, TheLastSampleComesWhenNoOtherFollows) {
  Decimation decimation(50 * kMillisecond);
  const auto sample = [](std::uint64_t k) {
    return HubSample{std::make_shared<const std::string>(std::to_string(k)), kStart + k * kMillisecond};
  };
  EXPECT_EQ(decimation.take(sample(0), {}).size(), 1u);
  EXPECT_TRUE(decimation.look(kStart + 100 * kMillisecond).empty()) << "nothing waits";
  EXPECT_TRUE(decimation.take(sample(10), {}).empty());
  EXPECT_TRUE(decimation.take(sample(20), {}).empty());
  EXPECT_TRUE(decimation.look(kStart + 49 * kMillisecond).empty());
  const auto last = decimation.look(kStart + 50 * kMillisecond);
  ASSERT_EQ(last.size(), 1u);
  EXPECT_EQ(*last[0].bytes, "20");
  EXPECT_TRUE(decimation.look(kStart + 200 * kMillisecond).empty()) << "once";
}

TEST(DecimationRules, AClockThatIsSetBackNeitherBlocksNorFloods) {
  Decimation decimation(50 * kMillisecond);
  const auto bytes = std::make_shared<const std::string>("x");
  std::size_t count = 0;
  for (std::uint64_t k = 0; k < 1000; ++k)
    count += decimation.take({bytes, kStart + k * kMillisecond}, {}).size();
  EXPECT_EQ(count, 20u);
  for (std::uint64_t k = 0; k < 1000; ++k)
    count += decimation.take({bytes, kStart / 2 + k * kMillisecond}, {}).size();
  EXPECT_GE(count, 40u);
  EXPECT_LE(count, 41u);
}

TEST(DecimationRules, WithoutARateEverySampleComes) {
  Decimation decimation(0);
  const auto bytes = std::make_shared<const std::string>("x");
  for (std::uint64_t k = 0; k < 100; ++k)
    EXPECT_EQ(decimation.take({bytes, kStart}, {}).size(), 1u);
}

TEST(DecimationRules, EventsAreChangesOfStatesFaultsAndOwners) {
  const auto events = [](const auto& message) {
    using M = std::decay_t<decltype(message)>;
    return featuresOf(M::kType, dds::encode(message)).events;
  };
  dds::ControlStatus status;
  const auto before = events(status);
  status.sequence = 77;
  status.task_error = {1.0, 2.0, 3.0, 4.0};
  status.iterations = 3;
  EXPECT_EQ(events(status), before);
  EXPECT_EQ(featuresOf(dds::ControlStatus::kType, dds::encode(status)).peaks[1].value, 2.0);
  const auto changed = [&](auto change) {
    dds::ControlStatus other = status;
    change(other);
    return events(other) != before;
  };
  EXPECT_TRUE(changed([](auto& s) { s.operating_state[1] = 2; }));
  EXPECT_TRUE(changed([](auto& s) { s.faults[7] = 1; }));
  EXPECT_TRUE(changed([](auto& s) { s.lease_owner = 5; }));
  EXPECT_TRUE(changed([](auto& s) { s.session = 5; }));
  dds::HalStatus hal;
  const auto pressed = events(hal);
  hal.emergency_stop = 2;
  EXPECT_NE(events(hal), pressed);
  dds::PlanningReference plan;
  const auto idle = events(plan);
  plan.point = 3;
  EXPECT_EQ(events(plan), idle);
  plan.phase = 1;
  EXPECT_NE(events(plan), idle);
  EXPECT_EQ(featuresOf(dds::ControlStatus::kType, "garbage").events, 0u);
}

}  // namespace
}  // namespace tandem::console
