// SPDX-License-Identifier: Apache-2.0
// Topics as bytes together with topics as messages, over loopback.
#include "services/dds/raw.h"

#include <malloc.h>

#include <stdexcept>

#include "pattern.h"
#include "support.h"

namespace tandem::dds {
namespace {

TopicInfo infoOf(const std::string& name) {
  for (const TopicInfo& topic : allTopics({"arm_a"})) {
    if (topic.name == name)
      return topic;
  }
  throw std::invalid_argument(name);
}

struct Received {
  std::vector<std::string> bytes;
  std::vector<RawSample> samples;
};

TEST(RawTopics, BytesAreThoseOfTheMessagesInOrder) {
  Bus typed(testOptions()), raw(testOptions());
  Watched<Received> received;
  Reader reader = rawReader(raw, infoOf("actuation/state"),
                            [&](const RawSample& sample) {
                              received.change([&](Received& h) {
                                h.bytes.emplace_back(sample.bytes);
                                h.samples.push_back(sample);
                              });
                            },
                            {.depth = 1000});
  Writer<ActuationState> writer = typed.writer(kActuationState);
  ASSERT_TRUE(repeatUntil([&] { return reader.matched() == 1 && writer.matched() == 1; }, [] {}));
  std::uint64_t written = 0;
  ASSERT_TRUE(repeatUntil([&] { return received.get().bytes.size() >= 20; },
                          [&] { EXPECT_TRUE(writer.write(patternState(7, ++written))); }));
  const Received all = received.get();
  for (std::size_t i = 0; i < all.bytes.size(); ++i) {
    const auto message = decode<ActuationState>(all.bytes[i]);
    ASSERT_TRUE(message);
    // A writer's sample numbers equal those of the pattern: a gap in one is a gap in the other.
    EXPECT_EQ(message->sequence, all.samples[i].sequence);
    EXPECT_EQ(encode(*message), encode(patternState(7, message->sequence)));
    EXPECT_EQ(all.samples[i].writer, all.samples[0].writer);
    EXPECT_GT(all.samples[i].source_time, 1'600'000'000'000'000'000);
  }
}

/// A recorder has a reader of each topic with a history of a thousand samples, nearly all of them empty.
TEST(RawTopics, ADeepHistoryReservesLittleMemory) {
  constexpr std::size_t kReaders = 20, kMost = 64 * 1024;  // bytes of each
  Bus raw(testOptions());
  const auto in_use = [] {
    const auto info = mallinfo2();
    return info.uordblks + info.hblkhd;
  };
  const std::size_t before = in_use();
  std::vector<Reader> readers;
  while (readers.size() < kReaders)
    readers.push_back(rawReader(raw, infoOf("diagnostics"), [](const RawSample&) {}, {.depth = 1000}));
  EXPECT_LT((in_use() - before) / kReaders, kMost);
}

TEST(RawTopics, WrittenBytesAreMessagesToOthers) {
  Bus typed(testOptions()), raw(testOptions());
  Watched<std::vector<DiagnosticArray>> received;
  Reader reader =
      typed.reader(kDiagnostics, [&](const DiagnosticArray& m) { received.change([&](auto& h) { h.push_back(m); }); });
  RawWriter writer(raw, infoOf("diagnostics"));
  DiagnosticArray message{5, "frame", {{1, "name", "text", "id", {{"key", std::string(20000, 'x')}}}}};
  ASSERT_TRUE(
      repeatUntil([&] { return received.get().size() > 3; }, [&] { EXPECT_TRUE(writer.write(encode(message))); }))
      << writer.lastProblem();
  EXPECT_EQ(encode(received.get()[0]), encode(message));
  EXPECT_FALSE(writer.write("abc"));
  EXPECT_FALSE(writer.write(std::string(5'000'000, 'x')));
  EXPECT_EQ(writer.statistics().refused, 2u);
}

TEST(RawTopics, OneBusHasATypeEitherAsMessagesOrAsBytes) {
  Bus bus(testOptions());
  Writer<Stop> writer = bus.writer(kStop);
  try {
    RawWriter bytes(bus, infoOf("stop"));
    FAIL() << "a process would have crashed";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("create a second dds::Bus to read it as bytes"), std::string::npos)
        << error.what();
  }
}

TEST(RawTopics, GarbageIsNoMessage) {
  EXPECT_FALSE(decode<ActuationState>(""));
  EXPECT_FALSE(decode<ActuationState>(std::string("\0\1\0\0too short", 13)));
  std::string bytes = encode(ActuationState{});
  EXPECT_TRUE(decode<ActuationState>(bytes));
  EXPECT_FALSE(decode<ActuationState>(bytes.substr(0, bytes.size() - 1)));
}

}  // namespace
}  // namespace tandem::dds
