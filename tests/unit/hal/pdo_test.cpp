// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/pdo.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "hal/canopen/cob.h"
#include "hal/canopen/emcy.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::canopen {
namespace {

TEST(PdoLayout, ValuesSurviveAndDoNotTouchEachOther) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    PdoLayout layout;
    while (layout.size() < PdoLayout::kMaxEntries) {
      const int bits = random.integer(1, 64);
      if (layout.add({{0x6040, 0}, bits}) < 0)
        break;
    }
    ASSERT_LE(layout.bits(), 64);
    std::array<std::int64_t, PdoLayout::kMaxEntries> values{};
    std::uint64_t word = 0;
    for (int round = 0; round < 50 && layout.size() > 0; ++round) {
      const int slot = random.integer(0, layout.size() - 1);
      const int bits = layout[slot].bits;
      const auto raw = static_cast<std::uint64_t>(random.integer(-0x7FFFFFFF, 0x7FFFFFFF)) * 0x9E3779B97F4A7C15u;
      values[slot] = signExtend(raw, bits);
      word = layout.with(word, slot, raw);
      for (int k = 0; k < layout.size(); ++k) {
        ASSERT_EQ(layout.getSigned(word, k), values[k]) << "slot " << k << " of " << layout.size();
        ASSERT_EQ(layout.get(word, k), lowBits(static_cast<std::uint64_t>(values[k]), layout[k].bits));
      }
    }
    ASSERT_EQ(word, lowBits(word, std::max(1, layout.bits()))) << "bits beyond the PDO";
  }
}

TEST(PdoLayout, BytesAreLittleEndianInOrder) {
  PdoLayout layout;
  const int word = layout.add({{0x6040, 0}, 16}), target = layout.add({{0x607A, 0}, 32});
  std::array<std::uint8_t, 6> bytes{};
  toBytes(layout.with(layout.with(0, word, 0x000F), target, static_cast<std::uint64_t>(-2)), bytes);
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 6>{0x0F, 0x00, 0xFE, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(layout.bytes(), 6);
  EXPECT_EQ(layout[target].raw(), 0x607A0020u);
  EXPECT_EQ(PdoEntry::fromRaw(0x607D0220).object, (ObjectAddress{0x607D, 2}));
}

TEST(PdoLayout, RefusesMappingsBeyond64Bits) {
  PdoLayout layout;
  EXPECT_EQ(layout.add({{1, 0}, 0}), -1);
  EXPECT_EQ(layout.add({{1, 0}, 65}), -1);
  EXPECT_EQ(layout.add({{1, 0}, 63}), 0);
  EXPECT_EQ(layout.add({{1, 0}, 2}), -1);
  EXPECT_EQ(layout.add({{1, 0}, 1}), 1);
  PdoLayout many;
  for (int k = 0; k < PdoLayout::kMaxEntries; ++k)
    EXPECT_EQ(many.add({{1, 0}, 8}), k);
  EXPECT_EQ(many.add({{1, 0}, 8}), -1);
}

TEST(PdoSteps, FollowTheOrderOfCia301AndReadAllBack) {
  PdoConfig pdo;
  pdo.number = 2;
  pdo.event_timer = 20;
  pdo.layout.add({{0x6040, 0}, 16});
  pdo.layout.add({{0x607A, 0}, 32});
  const auto steps = pdoSteps(pdo, PdoDirection::kReceive, 5);
  std::vector<SetupStep> writes, checks;
  for (const SetupStep& step : steps) {
    EXPECT_TRUE(checks.empty() || step.kind == SetupStep::Kind::kCheck) << "reads come last";
    (step.kind == SetupStep::Kind::kCheck ? checks : writes).push_back(step);
  }
  ASSERT_EQ(writes.size(), 8u);
  EXPECT_EQ(writes.front().object, (ObjectAddress{0x1401, 1}));
  EXPECT_EQ(writes.front().value, 0x80000305u);
  EXPECT_EQ(writes[1].object, (ObjectAddress{0x1601, 0}));
  EXPECT_EQ(writes[1].value, 0u);
  EXPECT_EQ(writes[4].object, (ObjectAddress{0x1601, 0}));
  EXPECT_EQ(writes[4].value, 2u);
  EXPECT_EQ(writes.back().object, (ObjectAddress{0x1401, 1}));
  EXPECT_EQ(writes.back().value, 0x305u);
  // The last value written to an object is the one that is verified.
  for (std::size_t k = 1; k < writes.size(); ++k) {
    const SetupStep* last = nullptr;
    for (const SetupStep& write : writes)
      last = write.object == writes[k].object ? &write : last;
    const bool checked = std::ranges::any_of(
        checks, [&](const SetupStep& check) { return check.object == last->object && check.value == last->value; });
    EXPECT_TRUE(checked) << describe(writes[k].object);
  }
}

TEST(PdoSteps, RefuseInvalidConfigurations) {
  PdoConfig pdo;
  EXPECT_THROW(pdoSteps(pdo, PdoDirection::kTransmit, 1), std::invalid_argument) << "no objects";
  pdo.layout.add({{0x6041, 0}, 16});
  EXPECT_EQ(cobIdOf(pdo, PdoDirection::kTransmit, 1), 0x181u);
  pdo.number = 4;
  EXPECT_EQ(cobIdOf(pdo, PdoDirection::kReceive, 127), 0x57Fu);
  pdo.number = 5;
  EXPECT_THROW(pdoSteps(pdo, PdoDirection::kTransmit, 1), std::invalid_argument) << "no predefined COB-ID";
  pdo.id = 0x1A0;
  EXPECT_NO_THROW(pdoSteps(pdo, PdoDirection::kTransmit, 1));
  pdo.id = 0x800;
  EXPECT_THROW(pdoSteps(pdo, PdoDirection::kTransmit, 1), std::invalid_argument);
  pdo.number = 513;
  EXPECT_THROW(pdoSteps(pdo, PdoDirection::kTransmit, 1), std::invalid_argument);
}

TEST(Emcy, RoundTripAndWords) {
  const Emcy emcy{0x8611, 0x21, {1, 2, 3, 4, 5}};
  const CanFrame frame = emcyFrame(0x83, emcy);
  const auto parsed = parseEmcy(frame);
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->code, 0x8611);
  EXPECT_EQ(parsed->error_register, 0x21);
  EXPECT_EQ(parsed->manufacturer, emcy.manufacturer);
  CanFrame shorter = frame;
  shorter.length = 7;
  EXPECT_FALSE(parseEmcy(shorter));
  EXPECT_EQ(describeErrorCode(0x8611), "8611: following error");
  EXPECT_EQ(describeErrorCode(0x2312), "2312: current, output side") << "the class of a code without text";
  EXPECT_EQ(describeErrorCode(0x7500), "7500: additional modules");
  EXPECT_EQ(describeErrorCode(0xFF42), "FF42: manufacturer specific");
}

TEST(Frames, OfNmtHeartbeatAndSync) {
  EXPECT_EQ(nmtFrame(NmtCommand::kStart, 3).id, 0u);
  EXPECT_EQ(nmtFrame(NmtCommand::kResetNode, 3).data[0], 129);
  EXPECT_EQ(nmtFrame(NmtCommand::kResetNode, 3).data[1], 3);
  EXPECT_EQ(heartbeatFrame(127, NmtState::kOperational).id, 0x77Fu);
  EXPECT_EQ(syncFrame(0).length, 0);
  EXPECT_EQ(syncFrame(7).length, 1);
  EXPECT_EQ(syncFrame(7).data[0], 7);
}

}  // namespace
}  // namespace tandem::hal::canopen
