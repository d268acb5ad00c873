// SPDX-License-Identifier: Apache-2.0
#include "recording/sample_ring.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <deque>
#include <fstream>
#include <iostream>
#include <random>
#include <thread>

namespace tandem::recording {
namespace {

TEST(SampleRing, HoldsTheNewestSamplesAndCountsTheOthers) {
  const auto seed = std::random_device{}();
  std::cout << "TANDEM_SEED=" << seed << std::endl;
  std::mt19937_64 random(seed);
  for (int round = 0; round < 50; ++round) {
    const std::size_t capacity = 200 + random() % 2000;
    SampleRing ring(capacity);
    std::deque<std::pair<std::uint64_t, std::string>> expected;
    std::size_t bytes = 0;
    SampleRing::Place place;
    std::uint64_t seen = 0, missed = 0;
    for (std::uint64_t i = 1; i <= 400; ++i) {
      const std::string data(random() % 140, static_cast<char>(random()));
      SampleTag tag;
      tag.sequence = tag.log_time = i;
      ASSERT_TRUE(ring.push(tag, data));
      expected.emplace_back(i, data);
      for (bytes += sizeof tag + data.size(); bytes > capacity; expected.pop_front())
        bytes -= sizeof tag + expected.front().second.size();
      ASSERT_EQ(ring.extent().oldest, expected.front().first);
      std::string copy;
      while (random() % 3 == 0 && ring.next(place, tag, copy, missed)) {
        ++seen;
        ASSERT_EQ(seen + missed, tag.sequence);
      }
    }
    SampleRing::Place from = ring.extent().begin;
    SampleTag tag;
    std::string copy;
    for (const auto& [sequence, data] : expected) {
      ASSERT_TRUE(ring.next(from, tag, copy, missed));
      EXPECT_EQ(tag.sequence, sequence);
      EXPECT_EQ(copy, data);
    }
    EXPECT_FALSE(ring.next(from, tag, copy, missed));
    EXPECT_EQ(ring.extent().begin.sample, 400 - expected.size());
    EXPECT_FALSE(ring.push({}, std::string(capacity, 'x'))) << "larger than the ring";
  }
}

/// Pages of the process in memory.
long pages() {
  long all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident;
}

TEST(SampleRing, AReaderThatKeepsUpNeedsASmallPartOfIt) {
  const auto seed = std::random_device{}();
  std::cout << "TANDEM_SEED=" << seed << std::endl;
  std::mt19937_64 random(seed);
  constexpr std::size_t kCapacity = 64'000'000;
  SampleRing ring(kCapacity, SampleRing::Memory::kOnDemand);
  const std::string data(20'000, 'x');
  SampleRing::Place place;
  SampleTag tag;
  std::string copy;
  std::uint64_t sent = 0, seen = 0, missed = 0;
  const auto keep_up = [&](int rounds, std::uint64_t most) {
    for (int round = 0; round < rounds; ++round) {
      for (std::uint64_t k = random() % most; k > 0; --k) {
        tag.sequence = ++sent;
        ASSERT_TRUE(ring.push(tag, data));
      }
      while (ring.next(place, tag, copy, missed))
        ASSERT_EQ(tag.sequence, ++seen + missed);
      ring.rewind(place);
    }
  };
  const long before = pages();
  keep_up(2000, 20);  // several times the capacity
  EXPECT_GT(sent * data.size(), 5 * kCapacity / 2);
  EXPECT_LT((pages() - before) * sysconf(_SC_PAGESIZE), 4'000'000);
  keep_up(5, 10'000);  // more than the ring holds: the oldest are overwritten
  EXPECT_GT(missed, 0u);
  EXPECT_EQ(seen + missed, sent);
  ring.push(tag, data);
  ring.rewind(place);
  EXPECT_TRUE(ring.next(place, tag, copy, missed)) << "what is not read yet stays";
}

TEST(SampleRing, ReadersAndWritersMayMeet) {
  SampleRing ring(20000);
  constexpr std::uint64_t kEach = 20000;
  const auto write = [&](std::uint32_t topic) {
    for (std::uint64_t i = 0; i < kEach; ++i) {
      SampleTag tag;
      tag.topic = topic;
      tag.sequence = i;
      ring.push(tag, std::string(i % 200, static_cast<char>('a' + topic)));
    }
  };
  std::thread a(write, 0), b(write, 1);
  std::uint64_t seen = 0, missed = 0, next[2] = {0, 0};
  SampleRing::Place place;
  SampleTag tag;
  std::string data;
  while (seen + missed < 2 * kEach) {
    if (!ring.next(place, tag, data, missed))
      continue;
    ++seen;
    ASSERT_GE(tag.sequence, next[tag.topic]);
    next[tag.topic] = tag.sequence + 1;
    ASSERT_EQ(data, std::string(tag.sequence % 200, static_cast<char>('a' + tag.topic)));
  }
  a.join();
  b.join();
  EXPECT_EQ(seen + missed, 2 * kEach);
  EXPECT_GT(seen, 0u);
}

}  // namespace
}  // namespace tandem::recording
