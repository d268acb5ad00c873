// SPDX-License-Identifier: Apache-2.0
#include "hal/can/candump.h"

#include <gtest/gtest.h>

#include <sstream>

#include "hal/can/virtual_bus.h"
#include "tests/unit/hal/random_frame.h"

namespace tandem::hal::can {
namespace {

TEST(Candump, EveryFrameSurvivesTheRoundTrip) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 2000; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const CanFrame frame = test::randomFrame(random, true);
    const std::int64_t stamp = 1'000'000'000'000'000 + std::int64_t{random.integer(0, 1 << 30)} * 1000;
    const std::string line = formatLogLine(frame, "vcan0", stamp);
    const LogEntry entry = parseLogLine(line);
    ASSERT_TRUE(sameOnWire(frame, entry.frame)) << line;
    ASSERT_EQ(entry.frame.time, stamp) << line;
    ASSERT_EQ(entry.interface, "vcan0");
  }
}

TEST(Candump, ReadsWhatCandumpWrites) {
  // Lines of candump -L, canplayer's examples and an error frame.
  struct Case {
    const char* line;
    std::uint32_t id;
    int length;
    bool extended, remote, error, fd;
  };
  const Case cases[] = {
      {"(1436509052.249713) vcan0 044#2A366C2BBA", 0x044, 5, false, false, false, false},
      {"(1436509052.449847) vcan0 0F6#7ADFE07BD2", 0x0F6, 5, false, false, false, false},
      {"(0000000000.000001) can1 12345678#", 0x12345678, 0, true, false, false, false},
      {"(1436509052.249713) vcan0 123#R", 0x123, 0, false, true, false, false},
      {"(1436509052.249713) vcan0 123#R8", 0x123, 8, false, true, false, false},
      {"(1436509052.249713) vcan0 20000040#0000000000000000", 0x40, 8, false, false, true, false},
      {"(1436509052.249713) vcan0 123##1112233445566778899AABBCC R", 0x123, 12, false, false, false, true},
      {"(1436509052.249713) vcan0 123#11.22.33 T", 0x123, 3, false, false, false, false},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.line);
    const CanFrame frame = parseLogLine(one.line).frame;
    EXPECT_EQ(frame.id, one.id);
    EXPECT_EQ(frame.length, one.length);
    EXPECT_EQ(frame.extended, one.extended);
    EXPECT_EQ(frame.remote, one.remote);
    EXPECT_EQ(frame.error, one.error);
    EXPECT_EQ(frame.fd, one.fd);
  }
}

TEST(Candump, NamesFileLineAndReason) {
  const std::pair<const char*, const char*> cases[] = {
      {"1436509052.249713 vcan0 044#2A", "(TIME)"},
      {"(1436509052) vcan0 044#2A", "a time"},
      {"(1.0) vcan0 044#2A3", "two digits"},
      {"(1.0) vcan0 044#ZZ", "hexadecimal"},
      {"(1.0) vcan0 44#2A", "3 or 8 digits"},
      {"(1.0) vcan0 844#2A", "11-bit"},
      {"(1.0) vcan0 F2345678#2A", "29-bit"},
      {"(1.0) vcan0 044", "ID#DATA"},
      {"(1.0) vcan0 044#112233445566778899", "length"},
      {"(1.0) vcan0", "an interface and a frame"},
      {"(1.0) vcan0 044#11 X", "at most R or T after the frame, found 'X'"},
      {"(1.0) vcan0 123##", "flags"},
      {"(1.0) vcan0 123#R108", "a length of at most 8, found 264"},
      {"(1.0) vcan0 123##0112233445566778899", "length"},
  };
  for (const auto& [line, reason] : cases) {
    std::istringstream in(std::string("# a comment\n\n(1.000000) vcan0 044#\n") + line + "\n");
    try {
      readLog(in, "run.log");
      FAIL() << line;
    } catch (const LogError& error) {
      EXPECT_EQ(std::string(error.what()).find("run.log:4: "), 0u) << error.what();
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << line << ": " << error.what();
    }
  }
}

TEST(Candump, WriterAddsTheOffset) {
  std::ostringstream out;
  LogWriter writer(out, "can0");
  CanFrame frame = makeFrame(0x181, {});
  frame.time = 2'500'000'000;
  writer.write(frame, 7'000'000'000);
  EXPECT_EQ(out.str(), "(0000000009.500000) can0 181#\n");
}

TEST(Candump, ReplaysWithTheRecordedTimes) {
  VirtualBus wire;
  auto& sender = wire.join("sender");
  auto& listener = wire.join("listener");
  std::istringstream in("(10.000000) a 001#01\n(10.000000) a 002#\n(10.004000) a 003#\n(10.010000) a 004#\n");
  LogReplayer replayer(readLog(in, "log"), 2.0);
  std::array<CanFrame, 8> frames;
  constexpr std::int64_t kStart = 5'000'000'000, kMs = 1'000'000;
  EXPECT_EQ(replayer.poll(sender, kStart), 2u);
  EXPECT_EQ(replayer.nextTime(), kStart + 2 * kMs);
  EXPECT_EQ(replayer.poll(sender, kStart + 2 * kMs - 1), 0u);
  EXPECT_EQ(replayer.poll(sender, kStart + 2 * kMs), 1u);
  EXPECT_FALSE(replayer.done());
  EXPECT_EQ(replayer.poll(sender, kStart + 60 * kMs), 1u);
  EXPECT_TRUE(replayer.done());
  ASSERT_EQ(listener.receive(frames), 4u);
  for (std::uint32_t k = 0; k < 4; ++k)
    EXPECT_EQ(frames[k].id, k + 1);
  EXPECT_THROW(LogReplayer({}, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::hal::can
