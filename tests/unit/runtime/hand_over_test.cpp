// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>

#include "services/runtime/latest_value.h"
#include "services/runtime/outbox.h"
#include "services/runtime/spsc_queue.h"

namespace tandem::runtime {
namespace {

/** A large value whose words all follow from the first, which reveals a torn copy. */
struct Block {
  std::array<std::uint64_t, 512> words{};

  void fill(std::uint64_t sequence) {
    for (std::size_t i = 0; i < words.size(); ++i) {
      words[i] = sequence * 1000003u + i;
    }
  }
  std::uint64_t sequence() const { return words[0] / 1000003u; }
  bool whole() const {
    Block expected;
    expected.fill(sequence());
    return expected.words == words;
  }
};

TEST(LatestValue, IsNewOnce) {
  LatestValue<int> slot;
  int value = 7;
  EXPECT_FALSE(slot.take(value));
  EXPECT_EQ(value, 7);
  slot.store(1);
  slot.store(2);
  EXPECT_TRUE(slot.take(value));
  EXPECT_EQ(value, 2);
  EXPECT_FALSE(slot.take(value));
  EXPECT_EQ(value, 2);
}

TEST(LatestValue, NeverTornAndNeverBackwards) {
  constexpr std::uint64_t kCount = 100'000;
  auto slot = std::make_unique<LatestValue<Block>>();
  std::thread writer([&] {
    Block block;
    for (std::uint64_t i = 1; i <= kCount; ++i) {
      block.fill(i);
      slot->store(block);
    }
  });
  Block seen;
  std::uint64_t last = 0, taken = 0, torn = 0, backwards = 0;
  while (last < kCount) {  // the last value remains in the slot until it is taken
    if (slot->take(seen)) {
      ++taken;
      torn += seen.whole() ? 0 : 1;
      backwards += seen.sequence() <= last ? 1 : 0;
      last = std::max(last, seen.sequence());
    }
  }
  writer.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backwards, 0u);
  EXPECT_GT(taken, 0u);
}

TEST(SpscQueue, HoldsItsCapacityInOrder) {
  EXPECT_THROW(SpscQueue<int>(0), std::invalid_argument);
  SpscQueue<int> queue(3);
  int value = 0;
  EXPECT_FALSE(queue.pop(value));
  for (int round = 0; round < 5; ++round) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_TRUE(queue.push(10 * round + i));
    }
    EXPECT_FALSE(queue.push(99));
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(queue.pop(value));
      EXPECT_EQ(value, 10 * round + i);
    }
  }
}

TEST(SpscQueue, LosesNothingBetweenTwoThreads) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  const std::size_t capacity = 1 + seed % 17;
  constexpr std::uint64_t kCount = 300'000;
  SpscQueue<std::uint64_t> queue(capacity);
  std::thread producer([&] {
    for (std::uint64_t i = 1; i <= kCount;) {
      if (queue.push(i))
        ++i;
      else
        std::this_thread::yield();  // both threads may share one processor
    }
  });
  std::uint64_t expected = 1, wrong = 0, value = 0;
  while (expected <= kCount) {
    if (queue.pop(value)) {
      wrong += value == expected++ ? 0 : 1;
    } else {
      std::this_thread::yield();
    }
  }
  producer.join();
  EXPECT_EQ(wrong, 0u);
  EXPECT_FALSE(queue.pop(value));
}

TEST(Outbox, QueueSendsAllInOrderAndCountsWhatDoesNotFit) {
  std::vector<int> sent;
  Outbox outbox;
  auto& queue = outbox.queue<int>(4, [&](const int& value) { sent.push_back(value); });
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(queue.post(i), i < 4);
  }
  EXPECT_EQ(queue.dropped(), 2u);
  outbox.start();
  EXPECT_THROW(outbox.latest<int>([](const int&) {}), std::logic_error);
  outbox.stop();  // sends what was posted before
  EXPECT_EQ(sent, (std::vector<int>{0, 1, 2, 3}));
}

TEST(Outbox, LatestArrivesWithoutAnotherPost) {
  std::mutex mutex;
  std::condition_variable changed;
  std::uint64_t last = 0;
  bool whole = true;
  Outbox outbox;
  auto& latest = outbox.latest<Block>([&](const Block& block) {
    std::lock_guard lock(mutex);
    whole = whole && block.whole();
    last = block.sequence();
    changed.notify_all();
  });
  outbox.start();
  Block block;
  for (std::uint64_t i = 1; i <= 20'000; ++i) {
    block.fill(i);
    latest.post(block);
  }
  std::unique_lock lock(mutex);
  EXPECT_TRUE(changed.wait_for(lock, std::chrono::seconds(20), [&] { return last == 20'000; })) << last;
  EXPECT_TRUE(whole);
}

}  // namespace
}  // namespace tandem::runtime
