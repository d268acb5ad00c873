// SPDX-License-Identifier: Apache-2.0
/** @file The console without sockets: protocol, queue, markers. */
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "services/console/client_queue.h"
#include "services/console/markers.h"
#include "services/console/palette.h"
#include "services/console/protocol.h"

namespace tandem::console {
namespace {

TEST(Protocol, BothNamesOfTheSubprotocol) {
  EXPECT_EQ(chooseSubprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chooseSubprotocol("chat , foxglove.websocket.v1,foxglove.sdk.v1"), "foxglove.sdk.v1");
  for (const char* other : {"", "chat", "foxglove.sdk.v2", "foxglove.sdk.v1x", ",,,"})
    EXPECT_EQ(chooseSubprotocol(other), std::nullopt) << other;
}

TEST(Protocol, ParsesRequestsOfClients) {
  const auto wanted = std::get<Subscribe>(
      parseText(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":3},{"id":4294967295,"channelId":0}]})"));
  EXPECT_EQ(wanted.subscriptions, (decltype(wanted.subscriptions){{7, 3}, {4294967295, 0}}));
  EXPECT_EQ(std::get<Unsubscribe>(parseText(R"({"op":"unsubscribe","subscriptionIds":[1]})")).ids,
            std::vector<std::uint32_t>{1});
  const auto offered = std::get<Advertise>(parseText(
      R"({"op":"advertise","channels":[{"id":2,"topic":"/t/stop","encoding":"cdr","schemaName":"tandem_msgs/msg/Stop"}]})"));
  ASSERT_EQ(offered.topics.size(), 1u);
  EXPECT_EQ(offered.topics[0].topic, "/t/stop");
  EXPECT_EQ(std::get<Unadvertise>(parseText(R"({"op":"unadvertise","channelIds":[2]})")).ids,
            std::vector<std::uint32_t>{2});
}

TEST(Protocol, WrongTextsAreNamed) {
  const std::pair<std::string, const char*> cases[] = {
      {"", "JSON object"},
      {"[1]", "JSON object"},
      {"{\"op\":", "JSON object"},
      {"{}", "op: expected a string"},
      {R"({"op":"fly"})", "op 'fly'"},
      {R"({"op":"subscribe"})", "subscriptions: is missing"},
      {R"({"op":"subscribe","subscriptions":{}})", "subscriptions: expected a list"},
      {R"({"op":"subscribe","subscriptions":[3]})", "id: is missing"},
      {R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})", "id: expected an integer from 0"},
      {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":4294967296}]})", "channelId: expected an integer"},
      {R"({"op":"unsubscribe","subscriptionIds":[1.5]})", "subscriptionIds: expected an integer"},
      {R"({"op":"advertise","channels":[{"id":1,"topic":5,"encoding":"cdr","schemaName":""}]})",
       "topic: expected a string"},
      {std::string(kMaxClientText + 1, ' '), "bytes of text, expected at most"},
      {std::string(200000, '['), "JSON object"},
  };
  for (const auto& [text, why] : cases) {
    const ClientText said = parseText(text);
    ASSERT_TRUE(std::holds_alternative<ProtocolError>(said)) << text.substr(0, 80);
    EXPECT_NE(std::get<ProtocolError>(said).why.find(why), std::string::npos) << std::get<ProtocolError>(said).why;
  }
}

TEST(Protocol, DamagedTextsAndFramesNeverHarm) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::string good = R"({"op":"advertise","channels":[{"id":2,"topic":"/t","encoding":"cdr","schemaName":"a"}]})";
  for (int round = 0; round < 3000; ++round) {
    std::string text = good.substr(0, random() % (good.size() + 1));
    for (unsigned k = random() % 4; k > 0 && !text.empty(); --k)
      text[random() % text.size()] = static_cast<char>(random());
    const ClientText said = parseText(text);
    if (const auto* why = std::get_if<ProtocolError>(&said)) {
      EXPECT_FALSE(why->why.empty());
      // The reported text is JSON, for any input.
      EXPECT_TRUE(
          nlohmann::json::parse(statusNote(StatusLevel::kError, why->why + text, "x"), nullptr, false).is_object());
    }
    const auto message = parseBinary(text);
    EXPECT_EQ(message.has_value(), text.size() >= 5 && text[0] == 1);
  }
}

TEST(Protocol, HeadersAreLittleEndian) {
  const MessageHeader header = messageHeader(0x04030201, 0x1817161514131211);
  const unsigned char expected[] = {1, 1, 2, 3, 4, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x18};
  EXPECT_EQ(std::memcmp(header.data(), expected, sizeof expected), 0);
  const auto message = parseBinary(std::string_view("\x01\x01\x02\x03\x04payload", 12));
  ASSERT_TRUE(message);
  EXPECT_EQ(message->topic, 0x04030201u);
  EXPECT_EQ(message->payload, "payload");
}

Outgoing frame(const std::string& text) {
  return {FrameKind::kSample, messageHeader(0, 0), std::make_shared<const std::string>(text)};
}

TEST(Queue, KeepsTheOrderAndTheNewest) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  ClientQueue queue;
  std::map<std::uint32_t, std::vector<int>> pushed, popped;
  const auto take = [&] {
    const auto next = queue.pop();
    if (!next)
      return false;
    const auto colon = next->payload->find(':');
    popped[static_cast<std::uint32_t>(std::stoul(*next->payload))].push_back(
        std::stoi(next->payload->substr(colon + 1)));
    return true;
  };
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t channel = random() % 6;
    queue.push(channel, channel < 3, frame(std::to_string(channel) + ":" + std::to_string(i)));
    pushed[channel].push_back(i);
    if (random() % 3 == 0)
      take();
  }
  while (take()) {
  }
  for (std::uint32_t channel = 3; channel < 6; ++channel)
    EXPECT_EQ(popped[channel], pushed[channel]) << "nothing of these is lost, whatever the others lose";
  std::uint64_t lost = 0;
  const auto dropped = queue.takeDropped();
  for (std::uint32_t channel = 0; channel < 3; ++channel) {
    EXPECT_TRUE(std::is_sorted(popped[channel].begin(), popped[channel].end()));
    const std::size_t kept = std::min(pushed[channel].size(), ClientQueue::kPerChannel);
    EXPECT_TRUE(std::equal(pushed[channel].end() - static_cast<std::ptrdiff_t>(kept), pushed[channel].end(),
                           popped[channel].end() - static_cast<std::ptrdiff_t>(kept)))
        << "the newest ones are there";
    EXPECT_EQ(dropped.at(channel), pushed[channel].size() - popped[channel].size());
    lost += dropped.at(channel);
  }
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(queue.dropped(), lost);
  EXPECT_TRUE(queue.takeDropped().empty());
}

TEST(Queue, OverflowsRatherThanLoseAnAnswer) {
  ClientQueue queue;
  const std::string megabyte(1024 * 1024, 'x');
  for (int i = 0; i < 20; ++i)
    queue.push(1, true, frame(megabyte));
  EXPECT_FALSE(queue.overflown()) << "samples that may be lost make room";
  EXPECT_GT(queue.dropped(), 10u);
  for (int i = 0; i < 7; ++i)
    queue.push(2, false, frame(megabyte));
  EXPECT_FALSE(queue.overflown());
  EXPECT_FALSE(queue.push(2, false, frame("small")));
  EXPECT_TRUE(queue.push(2, false, frame(megabyte))) << "who sends has to learn of it";
  EXPECT_TRUE(queue.overflown());
  EXPECT_FALSE(queue.pop());
}

TEST(Queue, KeepsWhatItHasWhenItIsSealed) {
  ClientQueue queue;
  queue.push(1, true, frame("state"));
  queue.push(ClientQueue::kText, false, frame("the reason of the end"));
  queue.seal();
  EXPECT_FALSE(queue.push(1, true, frame("later")));
  EXPECT_FALSE(queue.overflown());
  EXPECT_EQ(*queue.pop()->payload, "state");
  EXPECT_EQ(*queue.pop()->payload, "the reason of the end");
  EXPECT_FALSE(queue.pop());
}

TEST(Queue, ForgetsAChannel) {
  ClientQueue queue;
  EXPECT_TRUE(queue.push(1, false, frame("a")));
  EXPECT_FALSE(queue.push(2, true, frame("b")));
  queue.forget(1);
  EXPECT_EQ(*queue.pop()->payload, "b");
  EXPECT_FALSE(queue.pop());
  EXPECT_TRUE(queue.push(1, false, frame("c"))) << "it was empty";
}

TEST(Marking, EveryPointOfTheShapeIsDrawn) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 100; ++round) {
    dds::Shape shape;
    shape.frame = "t_base";
    const std::size_t count = random() % 60;
    std::uint8_t tube = 3;
    for (std::size_t i = 0; i < count; ++i) {
      if (random() % 10 == 0 && tube > 1)
        --tube;
      shape.tubes.push_back(tube);
      shape.outer_radius.push_back(0.001f * static_cast<float>(tube));
      for (int axis = 0; axis < 3; ++axis)
        shape.points.push_back(static_cast<float>(random() % 1000));
    }
    const int arm = static_cast<int>(random() % 4);
    const dds::MarkerArray array = markersOf(shape, {"arm_a", arm, 3}, 5);
    std::size_t drawn = 0;
    for (std::size_t k = 0; k < array.markers.size(); ++k) {
      const dds::Marker& marker = array.markers[k];
      EXPECT_EQ(marker.id, static_cast<int>(k));
      EXPECT_EQ(marker.frame, "t_base");
      EXPECT_GT(marker.scale[0], 0.0);
      EXPECT_GT(marker.lifetime, 0);
      EXPECT_EQ(marker.ns, "arm_a");
      if (marker.type == 4)
        drawn += marker.points.size() - (k == 0 ? 0 : 1);
    }
    EXPECT_EQ(drawn, count) << "stretches share the point at which they meet";
    if (count > 0) {
      EXPECT_EQ(array.markers.front().color, rgba(tubeColor(arm, shape.tubes.front() - 1, 3)));
      EXPECT_EQ(array.markers.back().type, 7);
      EXPECT_EQ(array.markers.back().points[0][2], shape.points.back());
    }
  }
}

}  // namespace
}  // namespace tandem::console
