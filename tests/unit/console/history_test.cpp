// SPDX-License-Identifier: Apache-2.0
/** @file What is kept for pages that are opened later: each event, and nothing that only repeats. */
#include "services/console/history.h"

#include <gtest/gtest.h>

#include <cstring>
#include <iostream>
#include <random>

#include "services/console/protocol.h"
#include "services/dds/raw.h"

namespace tandem::console {
namespace {

class EventsForLaterPages : public testing::Test {
 protected:
  EventsForLaterPages() : topics_(dds::allTopics({"arm_a", "arm_b"})) {}

  template <class M>
  void take(const std::string& topic, const M& message, std::uint64_t time) {
    for (std::uint32_t k = 0; k < topics_.size(); ++k) {
      if (topics_[k].name != topic)
        continue;
      EXPECT_TRUE(History::concerns(topics_[k])) << topic;
      const std::string bytes = dds::encode(message);
      history_.take(k, topics_[k], {std::make_shared<const std::string>(bytes), time},
                    featuresOf(topics_[k].type, bytes));
      return;
    }
    ADD_FAILURE() << topic;
  }
  /// Topic and time of each kept sample.
  std::vector<std::pair<std::string, std::uint64_t>> kept() const {
    const std::string answer = history_.packed(7);
    std::vector<std::pair<std::string, std::uint64_t>> all;
    for (std::size_t at = sizeof(std::uint64_t); at < answer.size();) {
      std::uint32_t length = 0, channel = 0;
      std::uint64_t time = 0;
      std::memcpy(&length, &answer[at], 4);
      std::memcpy(&channel, &answer[at + 5], 4);
      std::memcpy(&time, &answer[at + 9], 8);
      all.emplace_back(topics_.at(channel).name, time);
      at += 4 + length;
    }
    return all;
  }

  std::vector<dds::TopicInfo> topics_;
  History history_;
};

TEST_F(EventsForLaterPages, AreChangesOfStatesAndNotTheSameStateAgain) {
  const unsigned seed = std::random_device{}();
  std::cout << "seed " << seed << "\n";
  std::mt19937 random(seed);
  dds::ControlStatus status{};
  std::vector<std::pair<std::string, std::uint64_t>> expected;
  for (std::uint64_t time = 1; time < 5000; ++time) {
    const std::uint32_t before = status.faults[1];
    if (random() % 100 == 0)
      status.faults[1] = random() % 4;
    status.sequence = time;
    status.task_error[0] = static_cast<double>(random());
    if (time == 1 || status.faults[1] != before)
      expected.emplace_back("control/status", time);
    take("control/status", status, time);
  }
  EXPECT_EQ(kept(), expected);
}

TEST_F(EventsForLaterPages, AreStopsWithoutTheirRepetitionsAndEndsOfProcesses) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  dds::Stop stop{};
  stop.client = 5;
  for (std::uint64_t time : {10 * kSecond, 10 * kSecond + kSecond / 10, 11 * kSecond, 13 * kSecond})
    take("stop", stop, time);
  stop.client = 6;
  take("stop", stop, 13 * kSecond + 1);
  dds::DiagnosticArray diagnostics{};
  diagnostics.status.resize(1);
  diagnostics.status[0].message = "runs";
  take("diagnostics", diagnostics, 14 * kSecond);
  diagnostics.status[0].message = "ended: SIGTERM";
  take("diagnostics", diagnostics, 15 * kSecond);
  EXPECT_EQ(
      kept(),
      (std::vector<std::pair<std::string, std::uint64_t>>{
          {"stop", 10 * kSecond}, {"stop", 13 * kSecond}, {"stop", 13 * kSecond + 1}, {"diagnostics", 15 * kSecond}}));
}

TEST_F(EventsForLaterPages, AreLimitedInNumberAndSizeAndTheNewestStay) {
  dds::Log line{};
  line.msg = std::string(5000, 'x');
  for (std::uint64_t time = 1; time <= 3000; ++time)
    take("/rosout", line, time);
  const auto long_ones = kept();
  EXPECT_LT(long_ones.size() * 5000, History::kBytes + 1);
  EXPECT_EQ(long_ones.back().second, 3000u);
  line.msg = "short";
  for (std::uint64_t time = 3001; time <= 9000; ++time)
    take("/rosout", line, time);
  EXPECT_EQ(kept().size(), History::kMost);
  EXPECT_EQ(kept().front().second, 9000u - History::kMost + 1);
}

TEST_F(EventsForLaterPages, AreThoseOfTheOtherTopicsAfterAFloodOfOne) {
  dds::ControlStatus status{};
  for (std::uint64_t time = 1; time <= 40; ++time) {
    status.faults[0] = time % 2;
    take("control/status", status, time);
  }
  std::uint64_t known = 0;
  history_.eventsAfter(known);
  dds::Log line{};
  line.msg = "request refused";
  for (std::uint64_t time = 41; time <= 10'000; ++time) {
    take("/rosout", line, time);
    line.msg = std::to_string(time);
  }
  const auto all = kept();
  ASSERT_EQ(all.size(), History::kMost);
  EXPECT_EQ(all[39], (std::pair<std::string, std::uint64_t>{"control/status", 40}));
  EXPECT_EQ(all[40].second, 10'000 - (History::kMost - 40) + 1);
  const auto later = history_.eventsAfter(known);
  ASSERT_EQ(later.size(), History::kMost - 40);  // nothing that was known
  EXPECT_EQ(later.front().number, 10'000u - later.size() + 1);
  line.msg = std::string(50'000, 'x');
  for (std::uint64_t time = 10'001; time <= 10'200; ++time) {
    line.msg[0] = static_cast<char>(time % 100);
    take("/rosout", line, time);
  }
  EXPECT_EQ(kept()[39].first, "control/status");  // the limit of bytes, too
}

}  // namespace
}  // namespace tandem::console
