// SPDX-License-Identifier: Apache-2.0
/** @file Node guarding on the master's side: which answers count. */
#include "hal/canopen/node_guard.h"

#include <gtest/gtest.h>

#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::canopen {
namespace {

using tandem::test::Random;

/// Answers get lost at random; those that arrive do so once or twice. No answer counts twice, each loss costs at most
/// one more answer, and a boot-up begins anew.
TEST(NodeGuard, AnAnswerCountsOnceAndALossCostsOneMore) {
  for (std::uint32_t run = 0; run < 200; ++run) {
    SCOPED_TRACE(tandem::test::trace(tandem::test::baseSeed() + run));
    Random random(tandem::test::baseSeed() + run);
    NodeGuard guard(33);
    NmtState state{};
    std::uint8_t toggle = 0;
    int lost = 0, ignored = 0;
    for (int k = 0; k < 300; ++k) {
      if (random.integer(0, 40) == 0) {
        guard.restart();
        toggle = 0;
        EXPECT_TRUE(guard.take(0, state));
        EXPECT_EQ(state, NmtState::kBootUp);
        lost = ignored = 0;
      }
      const auto answer = static_cast<std::uint8_t>(5 | toggle);
      toggle ^= 0x80;
      if (random.integer(0, 4) == 0) {
        ++lost;
        continue;
      }
      const bool counts = guard.take(answer, state);
      EXPECT_EQ(state, NmtState::kOperational);
      ignored += counts ? 0 : 1;
      EXPECT_FALSE(counts && guard.take(answer, state)) << "the same answer again";
      EXPECT_LE(ignored, lost);
    }
  }
}

TEST(NodeGuard, OnlyStatesOfTheStandardCount) {
  for (int byte = 0; byte < 256; ++byte) {
    NmtState state{};
    const int number = byte & 0x7F;
    const bool known = number == 0 || number == 4 || number == 5 || number == 127;
    EXPECT_EQ(NodeGuard(0).take(static_cast<std::uint8_t>(byte), state), known && byte < 128) << byte;
    EXPECT_EQ(NodeGuard(33).take(static_cast<std::uint8_t>(byte), state), known && (byte < 128 || number == 0)) << byte;
  }
}

TEST(NodeGuard, AsksOnItsTimeGridWithoutBursts) {
  for (std::uint32_t run = 0; run < 200; ++run) {
    SCOPED_TRACE(tandem::test::trace(tandem::test::baseSeed() + run));
    Random random(tandem::test::baseSeed() + run);
    NodeGuard guard(100);
    int sent = 0;
    std::int64_t now = 1000, before = -1000, end = 1000 + 5000;
    for (; now < end; now += random.integer(1, run % 2 == 0 ? 20 : 250)) {
      if (!guard.due(now))
        continue;
      EXPECT_GE(now - before, 1);
      guard.sent(now);
      EXPECT_FALSE(guard.due(now)) << "no two requests at one time";
      before = now;
      ++sent;
    }
    EXPECT_LE(sent, 51);
    if (run % 2 == 0) {
      EXPECT_GE(sent, 49);
    }
    EXPECT_FALSE(NodeGuard(0).due(now));
  }
  const CanFrame frame = guardFrame(17);
  EXPECT_TRUE(frame.remote);
  EXPECT_EQ(frame.id, 0x711u);
  EXPECT_TRUE(frame.payload().empty());
}

}  // namespace
}  // namespace tandem::hal::canopen
