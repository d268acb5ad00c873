// SPDX-License-Identifier: Apache-2.0
/** @file The SDO client with the server of the simulated devices, with and without losses. */
#include <gtest/gtest.h>

#include <map>

#include "hal/canopen/bytes.h"
#include "hal/canopen/cob.h"
#include "hal/canopen/sdo_client.h"
#include "sim/drives/sdo_server.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::canopen {
namespace {

constexpr int kNode = 5;
constexpr std::int64_t kTimeout = 50'000'000, kStep = 1'000'000;

/** A dictionary of byte strings. */
class Store final : public sim::drives::SdoAccess {
 public:
  std::map<ObjectAddress, std::vector<std::uint8_t>> objects;
  SdoAbort refusal = SdoAbort::kNone;

  SdoAbort readObject(ObjectAddress object, std::span<std::uint8_t> bytes, std::size_t& size) override {
    if (refusal != SdoAbort::kNone)
      return refusal;
    const auto found = objects.find(object);
    if (found == objects.end())
      return SdoAbort::kNoObject;
    size = std::min(bytes.size(), found->second.size());
    std::copy_n(found->second.begin(), size, bytes.begin());
    return SdoAbort::kNone;
  }
  SdoAbort writeObject(ObjectAddress object, std::span<const std::uint8_t> bytes) override {
    if (refusal != SdoAbort::kNone)
      return refusal;
    objects[object].assign(bytes.begin(), bytes.end());
    return SdoAbort::kNone;
  }
};

/** Client and server with a lossy link between them. */
struct Link {
  Store store;
  sim::drives::SdoServer server{kNode, store};
  SdoClient client{kNode, kTimeout};
  test::Random* random = nullptr;
  double loss = 0.0;
  std::int64_t now = 0;
  int frames = 0;

  bool lost() { return random != nullptr && random->chance(loss); }
  void toClient(const CanFrame& frame) {
    if (!lost()) {
      EXPECT_TRUE(client.feed(frame, now));
    }
  }
  /// Runs until the client is done; false after 10 s of simulated time.
  bool run() {
    const std::int64_t end = now + 10'000'000'000;
    for (; now < end; now += kStep) {
      while (const CanFrame* request = client.request()) {
        const CanFrame frame = *request;
        client.sent(now);
        ++frames;
        CanFrame answer;
        if (!lost() && server.handle(frame, now, answer))
          toClient(answer);
      }
      CanFrame abort;
      if (server.poll(now, abort))
        toClient(abort);
      client.poll(now);
      if (!client.busy() && client.request() == nullptr)
        return true;
    }
    return false;
  }
};

std::vector<std::uint8_t> randomBytes(test::Random& random, int size) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  for (auto& byte : bytes)
    byte = static_cast<std::uint8_t>(random.integer(0, 255));
  return bytes;
}

int randomSize(test::Random& random) { return random.chance(0.6) ? random.integer(0, 15) : random.integer(0, 1024); }

TEST(Sdo, WhatIsWrittenIsRead) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    Link link;
    const auto bytes = randomBytes(random, randomSize(random));
    const ObjectAddress object{static_cast<std::uint16_t>(random.integer(0, 0xFFFF)),
                               static_cast<std::uint8_t>(random.integer(0, 255))};
    ASSERT_TRUE(link.client.download(object, bytes, link.now));
    ASSERT_TRUE(link.run());
    ASSERT_EQ(link.client.status(), SdoStatus::kDone) << describe(link.client.abort());
    ASSERT_EQ(link.store.objects[object], bytes);
    const int expected =
        bytes.size() >= 1 && bytes.size() <= 4 ? 1 : 1 + std::max(1, static_cast<int>((bytes.size() + 6) / 7));
    ASSERT_EQ(link.frames, expected) << "expedited up to four bytes, seven per segment";
    link.client.upload(object, link.now);
    ASSERT_TRUE(link.run());
    ASSERT_EQ(link.client.status(), SdoStatus::kDone) << describe(link.client.abort());
    ASSERT_TRUE(std::ranges::equal(link.client.data(), bytes));
    ASSERT_EQ(link.client.unexpectedResponses(), 0u);
  }
}

/// CiA 301 permits an answer of four bytes for a smaller number, with and without its size.
TEST(Sdo, ANumberIsReadInEachFormOfTheAnswer) {
  using sim::drives::AnswerForm;
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    for (const AnswerForm form : {AnswerForm::kSized, AnswerForm::kUnsized, AnswerForm::kFourBytes}) {
      Link link;
      link.server.form = form;
      const int size = random.integer(1, 4);
      const auto bytes = randomBytes(random, size);
      link.store.objects[{0x605A, 0}] = bytes;
      link.client.upload({0x605A, 0}, link.now);
      ASSERT_TRUE(link.run());
      ASSERT_EQ(link.client.status(), SdoStatus::kDone);
      bool fits = false;
      ASSERT_EQ(link.client.value(size, fits), fromBytes(bytes)) << static_cast<int>(form);
      ASSERT_TRUE(fits);
    }
  }
}

TEST(Sdo, ALargerNumberDoesNotFit) {
  Link link;
  link.store.objects[{0x605A, 0}] = {2, 0, 1, 0};
  link.client.upload({0x605A, 0}, link.now);
  ASSERT_TRUE(link.run());
  bool fits = true;
  EXPECT_EQ(link.client.value(2, fits), 0x10002u) << "the whole number, for the message";
  EXPECT_FALSE(fits);
}

TEST(Sdo, WithLostFramesATransferIsCorrectOrFails) {
  int done = 0, failed = 0;
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    Link link;
    link.random = &random;
    link.loss = 0.05;
    const ObjectAddress object{0x2000, 1};
    const auto before = randomBytes(random, randomSize(random));
    const auto after = randomBytes(random, randomSize(random));
    link.store.objects[object] = before;
    link.client.download(object, after, link.now);
    ASSERT_TRUE(link.run()) << "a transfer ends";
    if (link.client.status() == SdoStatus::kDone) {
      ASSERT_EQ(link.store.objects[object], after);
    } else {
      ASSERT_EQ(link.client.abort(), SdoAbort::kTimeout) << describe(link.client.abort());
      ASSERT_TRUE(link.store.objects[object] == before || link.store.objects[object] == after) << "half written";
    }
    link.client.upload(object, link.now);
    ASSERT_TRUE(link.run());
    if (link.client.status() == SdoStatus::kDone) {
      ASSERT_TRUE(std::ranges::equal(link.client.data(), link.store.objects[object]));
      ++done;
    } else {
      ++failed;
    }
    // In any case, the next transfer on a good link succeeds.
    link.loss = 0.0;
    link.client.upload(object, link.now);
    ASSERT_TRUE(link.run());
    ASSERT_EQ(link.client.status(), SdoStatus::kDone) << describe(link.client.abort());
    ASSERT_TRUE(std::ranges::equal(link.client.data(), link.store.objects[object]));
  }
  EXPECT_GT(done, 50);
  EXPECT_GT(failed, 50);
}

TEST(Sdo, AbortsOfTheNodeArrive) {
  for (const SdoAbort code : {SdoAbort::kReadOnly, SdoAbort::kNoSubIndex, SdoAbort::kValueTooHigh,
                              SdoAbort::kDeviceState, static_cast<SdoAbort>(0x12345678)}) {
    Link link;
    link.store.refusal = code;
    link.client.download({0x6040, 0}, 6, 2, link.now);
    ASSERT_TRUE(link.run());
    EXPECT_EQ(link.client.status(), SdoStatus::kAborted);
    EXPECT_EQ(link.client.abort(), code);
    link.client.upload({0x6040, 0}, link.now);
    ASSERT_TRUE(link.run());
    EXPECT_EQ(link.client.abort(), code);
  }
  EXPECT_EQ(describe(SdoAbort::kValueTooHigh), "06090031: value too high");
  EXPECT_EQ(describe(static_cast<SdoAbort>(0x12345678)), "12345678: not a code of CiA 301");
}

TEST(Sdo, SilenceTimesOutAndSendsAnAbort) {
  SdoClient client(kNode, kTimeout);
  client.upload({0x1000, 0}, 0);
  ASSERT_NE(client.request(), nullptr);
  client.sent(10);
  EXPECT_EQ(client.request(), nullptr);
  client.poll(9 + kTimeout);
  EXPECT_TRUE(client.busy());
  client.poll(10 + kTimeout);
  EXPECT_EQ(client.abort(), SdoAbort::kTimeout);
  ASSERT_NE(client.request(), nullptr);
  EXPECT_EQ(sdo::requestOf(*client.request()), sdo::Request::kAbort);
  EXPECT_EQ(sdo::abortOf(*client.request()), SdoAbort::kTimeout);
}

TEST(Sdo, AWrongToggleAborts) {
  SdoClient client(kNode, kTimeout);
  const std::array<std::uint8_t, 20> bytes{};
  constexpr std::uint32_t kId = cob::kSdoAnswer + kNode;
  client.download({0x2000, 0}, bytes, 0);
  client.sent(0);
  client.feed(sdo::downloadAnswer(kId, {0x2000, 0}), 1);
  client.sent(1);
  client.feed(sdo::downloadSegmentAnswer(kId, true), 2);  // the first toggle is 0
  EXPECT_EQ(client.abort(), SdoAbort::kToggle);
  Link link;
  link.store.objects[{0x2000, 0}].resize(20);
  CanFrame answer;
  link.server.handle(sdo::uploadRequest(0x600 + kNode, {0x2000, 0}), 0, answer);
  link.server.handle(sdo::uploadSegmentRequest(0x600 + kNode, true), 0, answer);
  EXPECT_EQ(sdo::answerOf(answer), sdo::Answer::kAbort);
  EXPECT_EQ(sdo::abortOf(answer), SdoAbort::kToggle);
}

TEST(Sdo, AnswersToOthersAreNotTaken) {
  SdoClient client(kNode, kTimeout);
  client.upload({0x1000, 0}, 0);
  client.sent(0);
  EXPECT_FALSE(client.feed(sdo::uploadRequest(cob::kSdoAnswer + kNode + 1, {0x1000, 0}), 1)) << "another node";
  const std::array<std::uint8_t, 4> data{1, 2, 3, 4};
  EXPECT_TRUE(client.feed(sdo::initiate(cob::kSdoAnswer + kNode, true, {0x1001, 0}, data), 1));
  EXPECT_TRUE(client.feed(sdo::abort(cob::kSdoAnswer + kNode, {0x1001, 0}, SdoAbort::kGeneral), 1));
  EXPECT_TRUE(client.busy()) << "late answers of an earlier transfer";
  EXPECT_EQ(client.unexpectedResponses(), 2u);
  EXPECT_TRUE(client.feed(sdo::initiate(cob::kSdoAnswer + kNode, true, {0x1000, 0}, data), 1));
  EXPECT_EQ(client.value(), 0x04030201u);
}

TEST(Sdo, ALongerTransferThanAnnouncedFails) {
  SdoClient client(kNode, kTimeout);
  constexpr std::uint32_t kId = cob::kSdoAnswer + kNode;
  const std::array<std::uint8_t, 9> nine{};
  client.upload({0x1008, 0}, 0);
  client.sent(0);
  client.feed(sdo::initiate(kId, true, {0x1008, 0}, nine), 1);
  client.sent(1);
  client.feed(sdo::segment(kId, false, false, std::span(nine).first(7)), 2);
  client.sent(2);
  client.feed(sdo::segment(kId, true, true, std::span(nine).first(7)), 3);
  EXPECT_EQ(client.abort(), SdoAbort::kTooLong);
  std::vector<std::uint8_t> large(SdoClient::kCapacity + 1);
  EXPECT_FALSE(client.download({0x1008, 0}, large, 4));
}

TEST(Sdo, NewTransferAbortsTheOldOne) {
  Link link;
  link.store.objects[{0x2000, 0}] = {1, 2};
  link.client.upload({0x2001, 0}, 0);
  link.client.upload({0x2000, 0}, 0);
  ASSERT_NE(link.client.request(), nullptr);
  EXPECT_EQ(sdo::requestOf(*link.client.request()), sdo::Request::kAbort);
  ASSERT_TRUE(link.run());
  EXPECT_EQ(link.client.status(), SdoStatus::kDone);
  EXPECT_EQ(link.client.value(), 0x0201u);
}

}  // namespace
}  // namespace tandem::hal::canopen
