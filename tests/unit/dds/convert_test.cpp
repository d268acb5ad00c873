// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "random_messages.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace {

using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

unsigned newSeed() { return std::random_device{}(); }

template <class M>
std::vector<unsigned char> encode(const M& message) {
  GuardedSupport<M> support;
  typename Wire<M>::Generated wire;
  toWire(message, wire);
  Payload payload(support.getSerializedSizeProvider(&wire)());
  EXPECT_TRUE(support.serialize(&wire, &payload));
  return {payload.data, payload.data + payload.length};
}

/// @return whether the bytes can be decoded.
template <class M>
bool decode(const std::vector<unsigned char>& bytes, M& message) {
  GuardedSupport<M> support;
  auto sample = std::make_unique<Sample<M>>();
  Payload payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  EXPECT_TRUE(support.deserialize(&payload, static_cast<typename Wire<M>::Generated*>(sample.get())));
  if (sample->decoded) {
    fromWire(*sample, message);
  }
  return sample->decoded;
}

/** Messages of fixed size: any bytes are a message, so equality after decoding and encoding proves that no member is
 * missing or exchanged, independently of any list of members. */
template <class M>
class FixedSize : public testing::Test {};
using FixedSizeMessages = testing::Types<ActuationState,
                                         ActuationCommand,
                                         ActuationLimits,
                                         PlanningReference,
                                         TipPoses,
                                         ControlStatus,
                                         HalStatus,
                                         HalRequest,
                                         TeleopInput>;
TYPED_TEST_SUITE(FixedSize, FixedSizeMessages);

TYPED_TEST(FixedSize, RandomBytesSurviveTheRoundTrip) {
  const unsigned seed = newSeed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  GuardedSupport<TypeParam> support;
  EXPECT_TRUE(support.is_plain());
  EXPECT_TRUE(support.is_bounded());
  std::vector<unsigned char> bytes = encode(TypeParam{});
  for (int round = 0; round < 50; ++round) {
    for (std::size_t i = 4; i < bytes.size(); ++i) {  // after the encapsulation header
      bytes[i] = static_cast<unsigned char>(random());
    }
    auto message = std::make_unique<TypeParam>();
    ASSERT_TRUE(decode(bytes, *message));
    typename Wire<TypeParam>::Generated wire;
    toWire(*message, wire);
    Payload payload(static_cast<std::uint32_t>(bytes.size()));
    std::memcpy(payload.data, bytes.data(), bytes.size());  // encoding leaves padding unchanged
    ASSERT_TRUE(support.serialize(&wire, &payload));
    ASSERT_EQ(payload.length, bytes.size());
    ASSERT_EQ(std::memcmp(payload.data, bytes.data(), bytes.size()), 0);
  }
}

TEST(FixedSizeMembers, LandWhereTheyBelong) {
  auto state = std::make_unique<ActuationState>();
  state->session = 1;
  state->sequence = 2;
  state->stamp = -3;
  state->arm_count = 2;
  state->faults[7] = 5;
  state->position[0] = 0.25;
  state->setpoint[63] = -0.5;
  auto back = std::make_unique<ActuationState>();
  ASSERT_TRUE(decode(encode(*state), *back));
  EXPECT_EQ(back->session, 1u);
  EXPECT_EQ(back->sequence, 2u);
  EXPECT_EQ(back->stamp, -3);
  EXPECT_EQ(back->arm_count, 2);
  EXPECT_EQ(back->faults[7], 5u);
  EXPECT_EQ(back->position[0], 0.25);
  EXPECT_EQ(back->setpoint[63], -0.5);
}

template <class M>
class AnySize : public testing::Test {};
using AnySizeMessages = testing::Types<PlanningRequest,
                                       Clearances,
                                       ComputationRequest,
                                       ComputationProgress,
                                       ComputationResult,
                                       RunSummary,
                                       Reply,
                                       ControlRequest,
                                       Stop,
                                       SimRequest,
                                       Shape,
                                       JointState,
                                       PoseStamped,
                                       TwistStamped,
                                       TeleopStatus,
                                       CrtkStatus,
                                       Path,
                                       OperatingState,
                                       StringStamped,
                                       DiagnosticArray,
                                       Log,
                                       MarkerArray>;
TYPED_TEST_SUITE(AnySize, AnySizeMessages);

TYPED_TEST(AnySize, RandomMessagesSurviveTheRoundTrip) {
  const unsigned seed = newSeed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Randomiser randomise(seed);
  for (int round = 0; round < 100; ++round) {
    TypeParam message, back;
    randomise(message);
    randomise(back);  // previous contents of a reused message must not persist
    ASSERT_TRUE(decode(encode(message), back));
    ASSERT_TRUE(same(message, back)) << "round " << round;
  }
}

TYPED_TEST(AnySize, DamagedBytesNeverHarm) {
  const unsigned seed = newSeed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Randomiser randomise(seed);
  for (int round = 0; round < 300; ++round) {
    TypeParam message, back;
    randomise(message);
    std::vector<unsigned char> bytes = encode(message);
    for (std::size_t hits = 1 + randomise.below(6); hits > 0; --hits) {
      bytes[randomise.below(bytes.size())] = static_cast<unsigned char>(randomise.below(256));
    }
    bytes.resize(randomise.below(2) == 0 ? bytes.size() : randomise.below(bytes.size()));
    if (decode(bytes, back)) {
      encode(back);  // decoded messages can be encoded
    }
  }
}

TYPED_TEST(AnySize, TruncatedBytesAreRefused) {
  const unsigned seed = newSeed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Randomiser randomise(seed);
  TypeParam message, back;
  randomise(message);
  const std::vector<unsigned char> bytes = encode(message);
  for (std::size_t length = 0; length + 4 < bytes.size(); ++length) {  // up to 3 bytes of padding may follow
    ASSERT_FALSE(decode(std::vector<unsigned char>(bytes.begin(), bytes.begin() + static_cast<long>(length)), back))
        << length << " of " << bytes.size();
  }
}

TEST(Stamps, NanosecondsAreNeverNegative) {
  PoseStamped pose;
  pose.stamp = -1;
  Wire<PoseStamped>::Generated wire;
  toWire(pose, wire);
  EXPECT_EQ(wire.header().stamp().sec(), -1);
  EXPECT_EQ(wire.header().stamp().nanosec(), 999'999'999u);
}

}  // namespace
}  // namespace tandem::dds
