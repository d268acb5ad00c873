// SPDX-License-Identifier: Apache-2.0
// Two participants in one process, over loopback.
#include "services/dds/bus.h"

#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <stdexcept>
#include <thread>

#include "support.h"

namespace tandem::dds {
namespace {

TEST(Bus, EveryTopicCarriesItsMessages) {
  Bus here(testOptions()), there(testOptions());
  int topics = 0;
  forEachTopic([&](const auto& topic) {
    using M = typename std::decay_t<decltype(topic)>::Message;
    const std::string arm = topic.per_arm ? "arm_a" : "";
    Writer<M> writer = here.writer(topic, arm);
    std::atomic<int> received{0};
    Reader reader = there.reader(topic, arm, [&](const M&) { ++received; });
    const M message{};
    EXPECT_TRUE(repeatUntil([&] { return received > 0; }, [&] { EXPECT_TRUE(writer.write(message)); })) << topic.name;
    EXPECT_EQ(writer.matched(), 1) << topic.name;
    EXPECT_EQ(reader.matched(), 1) << topic.name;
    EXPECT_EQ(writer.lastProblem() + reader.lastProblem(), "") << topic.name;
    ++topics;
  });
  EXPECT_EQ(topics, static_cast<int>(allTopics({"arm_a"}).size()));
}

TEST(Bus, ArmNamesAreRequiredForTopicsOfArmsAlone) {
  Bus bus(testOptions());
  EXPECT_THROW(bus.writer(kMeasuredJs), std::invalid_argument);
  EXPECT_THROW(bus.writer(kStop, "arm_a"), std::invalid_argument);
  EXPECT_THROW(bus.reader(kMeasuredJs, "arm a", [](const JointState&) {}), std::invalid_argument);
}

TEST(Bus, PrefixesAndArmsAreKeptApart) {
  BusOptions other = testOptions();
  other.prefix += "_other";
  Bus bus(testOptions()), other_bus(other);
  std::atomic<int> wrong{0}, right{0};
  Reader wrong_arm = bus.reader(kStateCommand, "arm_b", [&](const StringStamped&) { ++wrong; });
  Reader wrong_robot = other_bus.reader(kStateCommand, "arm_a", [&](const StringStamped&) { ++wrong; });
  Reader own = bus.reader(kStateCommand, "arm_a", [&](const StringStamped&) { ++right; });
  auto writer = bus.writer(kStateCommand, "arm_a");
  EXPECT_TRUE(repeatUntil([&] { return right > 20; }, [&] { writer.write({}); }));
  EXPECT_EQ(wrong, 0);
}

TEST(Bus, ALateReaderGetsTheLatchedSample) {
  Bus here(testOptions()), there(testOptions());
  auto writer = here.writer(kOperatingState, "arm_a");
  OperatingState state;
  state.state = "DISABLED";
  writer.write(state);
  state.state = "ENABLED";
  state.stamp = 5;
  writer.write(state);
  Watched<std::vector<OperatingState>> seen;
  Reader reader = there.reader(kOperatingState, "arm_a",
                               [&](const OperatingState& m) { seen.change([&](auto& list) { list.push_back(m); }); });
  ASSERT_TRUE(seen.waitUntil([](const auto& list) { return !list.empty(); }));
  EXPECT_EQ(seen.get()[0].state, "ENABLED");
  EXPECT_EQ(seen.get()[0].stamp, 5);
}

TEST(Bus, LongTrajectoriesPass) {
  Bus here(testOptions()), there(testOptions());
  Watched<std::size_t> length;
  PlanningRequest request;
  for (int i = 0; i < 1'000'000; ++i) {
    request.trajectory += static_cast<char>('a' + i % 26);
  }
  Reader reader = there.reader(kPlanningRequest, [&](const PlanningRequest& m) {
    length.change([&](auto& n) { n = m.trajectory == request.trajectory ? m.trajectory.size() : 1; });
  });
  auto writer = here.writer(kPlanningRequest);
  ASSERT_TRUE(repeatUntil([&] { return writer.matched() == 1 && reader.matched() == 1; }, [] {}));
  EXPECT_TRUE(writer.write(request));
  EXPECT_TRUE(length.waitUntil([](std::size_t n) { return n > 0; }));
  EXPECT_EQ(length.get(), 1'000'000u);
}

TEST(Bus, RefusesToWriteWhatNobodyMayRead) {
  Bus bus(testOptions());
  auto writer = bus.writer(kActuationState);
  ActuationState state;
  state.arm_count = 9;
  EXPECT_FALSE(writer.write(state));
  EXPECT_EQ(writer.statistics().refused, 1u);
  EXPECT_NE(writer.lastProblem().find("arm_count"), std::string::npos);
  EXPECT_FALSE(Writer<ActuationState>().write(state));
}

TEST(Bus, DifferentQualityOfServiceIsReportedOnBothEnds) {
  BusOptions lock_step = testOptions();
  lock_step.deterministic = true;
  Bus here(testOptions()), there(lock_step);
  auto writer = here.writer(kActuationState);
  Reader reader = there.reader(kActuationState, [](const ActuationState&) {});
  EXPECT_TRUE(
      repeatUntil([&] { return writer.statistics().incompatible > 0 && reader.statistics().incompatible > 0; }, [] {}));
  EXPECT_NE(writer.lastProblem().find("reliability"), std::string::npos) << writer.lastProblem();
  EXPECT_NE(reader.lastProblem().find("reliability"), std::string::npos) << reader.lastProblem();
}

TEST(Bus, ADeepReaderMatchesWhateverTheWriterOffers) {
  BusOptions slow = testOptions(), quick = testOptions();
  slow.command_age = 3.0;
  quick.command_age = 0.03;  // requests a deadline and a liveliness that the slow writer does not offer
  Bus commander(slow), observer(quick);
  auto writer = commander.writer(kActuationCommand);
  std::atomic<int> wrong{0}, seen{0};
  Reader refused = observer.reader(kActuationCommand, [&](const ActuationCommand&) { ++wrong; });
  Reader deep = observer.reader(
      kActuationCommand, [&](const ActuationCommand&) { ++seen; }, ReaderOptions{1000});
  EXPECT_TRUE(
      repeatUntil([&] { return seen > 20 && refused.statistics().incompatible > 0; }, [&] { writer.write({}); }));
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(deep.statistics().incompatible, 0u) << deep.lastProblem();
  EXPECT_NE(refused.lastProblem().find("was rejected: different "), std::string::npos) << refused.lastProblem();
}

TEST(Bus, OwnershipPassesOnWhenTheCommanderTimesOut) {
  BusOptions options = testOptions();
  options.command_age = 0.03;
  Bus robot(options), first(options), second(options);
  Watched<std::map<std::uint64_t, int>> received;
  Reader reader = robot.reader(kActuationCommand, [&](const ActuationCommand& m) {
    received.change([&](auto& counts) { ++counts[m.control_session]; });
  });
  auto one = first.writer(kActuationCommand), two = second.writer(kActuationCommand);
  ActuationCommand from_one, from_two;
  from_one.control_session = 1;
  from_two.control_session = 2;
  const auto both = [&] {
    one.write(from_one);
    two.write(from_two);
  };
  const auto count = [&](std::uint64_t session) {
    const auto counts = received.get();
    return counts.count(session) > 0 ? counts.at(session) : 0;
  };
  ASSERT_TRUE(repeatUntil([&] { return reader.matched() == 2 && count(1) + count(2) > 50; }, both));
  received.change([](auto& counts) { counts.clear(); });
  ASSERT_TRUE(repeatUntil([&] { return count(1) > 50 || count(2) > 50; }, both));
  const std::uint64_t owner = count(1) > count(2) ? 1 : 2;
  // A pause of the machine longer than the 30 ms of grace may change the owner; but both must not be received
  // throughout.
  EXPECT_LT(count(3 - owner), 25);
  ASSERT_TRUE(repeatUntil([&] { return count(3 - owner) > 50; },
                          [&] { owner == 1 ? two.write(from_two) : one.write(from_one); }));
}

TEST(Bus, SilenceOfACommanderIsCounted) {
  BusOptions options = testOptions();
  options.command_age = 0.03;
  Bus here(options), there(options);
  auto writer = here.writer(kActuationCommand);
  Reader reader = there.reader(kActuationCommand, [](const ActuationCommand&) {});
  ASSERT_TRUE(repeatUntil([&] { return reader.received() > 0; }, [&] { writer.write({}); }));
  EXPECT_TRUE(repeatUntil([&] { return reader.statistics().deadline_missed > 2; }, [] {}));
}

TEST(Bus, InLockStepABurstArrivesWholeAndInOrder) {
  constexpr std::uint64_t kCount = 3000;
  BusOptions options = testOptions();
  options.deterministic = true;
  Bus here(options), there(options);
  Watched<std::uint64_t> last;
  std::atomic<std::uint64_t> gaps{0};
  Reader reader = there.reader(kActuationState, [&](const ActuationState& m) {
    last.change([&](std::uint64_t& sequence) {
      gaps += m.sequence == sequence + 1 ? 0 : 1;
      sequence = m.sequence;
    });
  });
  auto writer = here.writer(kActuationState);
  ASSERT_TRUE(repeatUntil([&] { return writer.matched() == 1 && reader.matched() == 1; }, [] {}));
  ActuationState state;
  for (state.sequence = 1; state.sequence <= kCount; ++state.sequence) {
    EXPECT_TRUE(writer.write(state));
  }
  EXPECT_TRUE(last.waitUntil([](std::uint64_t sequence) { return sequence == kCount; })) << last.get();
  EXPECT_EQ(gaps, 0u);
}

TEST(Bus, ReadersMayGoWhileSamplesCome) {
  auto here = std::make_unique<Bus>(testOptions());
  Bus there(testOptions());
  std::atomic<bool> stop{false};
  auto writer = there.writer(kHalStatus);
  std::thread busy([&] {
    while (!stop) {
      writer.write({});
    }
  });
  for (int round = 0; round < 10; ++round) {
    auto counter = std::make_unique<std::atomic<int>>(0);
    auto* raw = counter.get();
    Reader reader = here->reader(kHalStatus, [raw](const HalStatus&) { ++*raw; });
    EXPECT_TRUE(repeatUntil([&] { return *raw > 0; }, [] {}));
    reader = Reader();  // from here on the callback must not use the counter
    counter.reset();
  }
  Reader survivor = here->reader(kHalStatus, [](const HalStatus&) {});
  here.reset();  // an endpoint may outlive its Bus
  EXPECT_TRUE(repeatUntil([&] { return survivor.received() > 0; }, [] {}));
  stop = true;
  busy.join();
}

TEST(Bus, ACallbackThatThrowsIsReported) {
  Bus here(testOptions()), there(testOptions());
  auto writer = here.writer(kStop);
  Reader reader = there.reader(kStop, [](const Stop&) { throw std::runtime_error("no brakes"); });
  EXPECT_TRUE(repeatUntil([&] { return !reader.lastProblem().empty(); }, [&] { writer.write({}); }));
  EXPECT_NE(reader.lastProblem().find("no brakes"), std::string::npos);
}

}  // namespace
}  // namespace tandem::dds
