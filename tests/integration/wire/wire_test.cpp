// SPDX-License-Identifier: Apache-2.0
// Processes over loopback: Tandem's, and Cyclone DDS as an oracle.
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <map>
#include <random>

#include "pattern.h"
#include "services/runtime/periodic_loop.h"
#include "support.h"

namespace tandem::dds {
namespace {

constexpr const char* kCycloneConfiguration =
    "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>31</MaxAutoParticipantIndex>"
    "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery>"
    "<Internal><GenerateKeyhash>true</GenerateKeyhash></Internal></Domain></CycloneDDS>";

std::vector<std::string> peer(const char* program, const char* mode, const std::string& extra = "") {
  const BusOptions options = testOptions();
  std::vector<std::string> arguments{program, mode, std::to_string(options.domain), options.prefix};
  if (!extra.empty()) {
    arguments.push_back(extra);
  }
  return arguments;
}

class WireTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { setenv("CYCLONEDDS_URI", kCycloneConfiguration, 1); }
};

TEST_F(WireTest, CycloneReadsOurMessagesValueForValue) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Child reader(peer(CYCLONE_PEER, "read"));
  Child writer(peer(WIRE_PEER, "publish", std::to_string(seed)));
  int states = 0, joints = 0, lines = 0;
  // Both streams have a period of 2 ms; many more lines than needed mean that one of them is missing.
  for (; (states < 100 || joints < 100) && lines < 5000; ++lines) {
    const std::string line = reader.line();
    ASSERT_FALSE(line.empty()) << "the reader ended";
    unsigned long long first = 0, second = 0;
    if (std::sscanf(line.c_str(), "state %llu %llu", &first, &second) == 2) {
      ++states;
      ASSERT_EQ(line, textOf(patternState(seed, second)));
    } else {
      ASSERT_EQ(std::sscanf(line.c_str(), "joints %llu %llu", &first, &second), 2) << line;
      ++joints;
      const unsigned long long stamp = first * 1'000'000'000 + second;
      ASSERT_EQ(line, textOf(patternJoints(seed, stamp / 1'000'000'007)));
    }
  }
  EXPECT_GE(states, 100);
  EXPECT_GE(joints, 100);
  EXPECT_EQ(writer.end(), 0);
  EXPECT_EQ(reader.end(), 0);
}

TEST_F(WireTest, ForeignMalformedSamplesAreDroppedAndCounted) {
  Bus bus(testOptions());
  std::atomic<int> bad{0};
  Reader reader = bus.reader(kActuationState, [&](const ActuationState& m) { bad += m.arm_count == 2 ? 0 : 1; });
  Child writer(peer(CYCLONE_PEER, "bad"));
  EXPECT_TRUE(repeatUntil([&] { return reader.received() >= 10 && reader.statistics().malformed >= 10; }, [] {}));
  EXPECT_EQ(bad, 0);
  EXPECT_NE(reader.lastProblem().find("arm_count above 8"), std::string::npos) << reader.lastProblem();
  EXPECT_EQ(writer.end(), 0);
}

TEST_F(WireTest, AReaderFindsTheNextWriterAfterACrash) {
  Bus bus(testOptions());
  Watched<std::map<std::uint64_t, int>> sessions;
  std::atomic<int> wrong{0};
  Reader reader = bus.reader(kActuationState, [&](const ActuationState& m) {
    wrong += textOf(m) == textOf(patternState(static_cast<unsigned>(m.session), m.sequence)) ? 0 : 1;
    sessions.change([&](auto& counts) { ++counts[m.session]; });
  });
  for (unsigned session = 1; session <= 3; ++session) {
    Child writer(peer(WIRE_PEER, "publish", std::to_string(session)));
    EXPECT_TRUE(sessions.waitUntil([&](const auto& counts) {
      return counts.count(session) > 0 && counts.at(session) > 50;
    })) << "session "
        << session;
    writer.crash();
  }
  EXPECT_EQ(wrong, 0);
}

/// Runs `rounds` rounds of state -> reference -> command through two other processes. @return s per round, sorted.
std::vector<double> runChain(Bus& bus, std::uint64_t rounds) {
  Watched<std::uint64_t> answered;
  Reader reader = bus.reader(kActuationCommand, [&](const ActuationCommand& m) {
    answered.change([&](std::uint64_t& last) { last = m.answers_state; });
  });
  auto writer = bus.writer(kActuationState);
  ActuationState state;
  state.sequence = 1;
  // Until the chain is matched; after that no sample may be lost.
  EXPECT_TRUE(repeatUntil([&] { return answered.get() == 1; }, [&] { writer.write(state); }));
  std::vector<double> times;
  while (state.sequence < rounds && !testing::Test::HasFailure()) {
    ++state.sequence;
    const std::int64_t begin = runtime::monotonicNow();
    writer.write(state);
    EXPECT_TRUE(answered.waitUntil([&](std::uint64_t last) { return last == state.sequence; }))
        << "state " << state.sequence << " was never answered";
    times.push_back(static_cast<double>(runtime::monotonicNow() - begin) * 1e-9);
  }
  std::sort(times.begin(), times.end());
  return times;
}

TEST_F(WireTest, LockStepLosesNothingAndIsFast) {
  BusOptions options = testOptions();
  options.deterministic = true;
  Bus bus(options);
  Child planning(peer(WIRE_PEER, "planning"));
  Child control(peer(WIRE_PEER, "control"));
  const std::vector<double> times = runChain(bus, 5000);
  ASSERT_EQ(times.size(), 4999u);
  const double median = times[times.size() / 2];
  const double high = times[times.size() * 99 / 100];
  std::cout << "three hops: median " << median * 1e6 << " us, 99 % " << high * 1e6 << " us, max " << times.back() * 1e6
            << " us\n";
  // About 200 us on an idle machine; the bound distinguishes tuned transport from one that waits for heartbeats (20
  // ms).
  EXPECT_LT(median, 3e-3);
}

}  // namespace
}  // namespace tandem::dds
