// SPDX-License-Identifier: Apache-2.0
/** @file What clients ask beside topics: parameters, services, the connection graph. */
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "services/console/connection_graph.h"
#include "services/console/hub.h"
#include "services/console/parameters.h"
#include "services/console/pending_requests.h"
#include "services/console/protocol.h"
#include "services/console/robot_requests.h"
#include "services/dds/raw.h"

namespace tandem::console {
namespace {

using Json = nlohmann::json;

TEST(RobotProtocol, ParsesRequestsForParametersAndTheGraph) {
  const auto get = std::get<GetParameters>(parseText(R"({"op":"getParameters","parameterNames":["a","b"],"id":"7"})"));
  EXPECT_EQ(get.names, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(get.id, "7");
  const auto set = std::get<SetParameters>(
      parseText(R"({"op":"setParameters","parameters":[{"name":"a","value":1.5},{"name":"method","value":"hqp"}]})"));
  EXPECT_EQ(set.parameters, (std::vector<Parameter>{{"a", 1.5}, {"method", "hqp"}}));
  EXPECT_EQ(set.id, std::nullopt);
  EXPECT_TRUE(std::get<WatchParameters>(parseText(R"({"op":"subscribeParameterUpdates","parameterNames":[]})")).watch);
  EXPECT_FALSE(
      std::get<WatchParameters>(parseText(R"({"op":"unsubscribeParameterUpdates","parameterNames":["a"]})")).watch);
  EXPECT_TRUE(std::get<WatchGraph>(parseText(R"({"op":"subscribeConnectionGraph"})")).watch);
  EXPECT_FALSE(std::get<WatchGraph>(parseText(R"({"op":"unsubscribeConnectionGraph"})")).watch);
  for (const char* wrong :
       {R"({"op":"getParameters"})", R"({"op":"getParameters","parameterNames":[1]})",
        R"({"op":"setParameters","parameters":[{"name":"a"}]})",
        R"({"op":"setParameters","parameters":[{"name":"a","value":true}]})",
        R"({"op":"setParameters","parameters":[{"value":1}]})", R"({"op":"getParameters","parameterNames":[],"id":7})"})
    EXPECT_TRUE(std::holds_alternative<ProtocolError>(parseText(wrong))) << wrong;
}

TEST(RobotProtocol, CallsAndRepliesKeepTheirNumbersAndBytes) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 300; ++round) {
    std::string frame(random() % 40, '\0');
    for (char& byte : frame)
      byte = static_cast<char>(random() % 4);
    if (!frame.empty())
      frame[0] = 2;
    const auto call = parseServiceCall(frame);
    if (!call)
      continue;
    EXPECT_EQ(13 + call->encoding.size() + call->payload.size(), frame.size());
    const std::string reply = serviceResponse(*call, call->payload);
    EXPECT_EQ(reply[0], 3);
    EXPECT_EQ(reply.substr(1, 8), frame.substr(1, 8)) << "the numbers of service and call";
    EXPECT_EQ(reply.substr(13), "cdr" + std::string(call->payload));
  }
  EXPECT_FALSE(parseServiceCall(std::string("\2\1\0\0\0\1\0\0\0\377\377\377\377cdr", 16))) << "longer than the frame";
  EXPECT_FALSE(parseServiceCall("\2"));
}

TEST(PendingReplies, AreMatchedByTheNumbersOfRequestAndReply) {
  const auto numbers = [](const auto& message) { return *numbersOfRequest(dds::encode(message)); };
  const auto expect = [&](auto request) {
    request.fingerprint = 5;
    request.client = 0x0102030405060708;
    request.request = 9;
    const RequestNumbers found = numbers(request);
    EXPECT_EQ(found.fingerprint, 5u);
    EXPECT_EQ(found.client, 0x0102030405060708u);
    EXPECT_EQ(found.request, 9u);
  };
  expect(dds::ControlRequest{});
  expect(dds::PlanningRequest{});
  expect(dds::ComputationRequest{});
  expect(dds::HalRequest{});
  expect(dds::SimRequest{});
  EXPECT_FALSE(numbersOfRequest("short"));
  dds::Reply reply;
  reply.client = 3;
  reply.request = 4;
  dds::ComputationResult result;
  result.client = 3;
  result.request = 4;
  for (const std::string& bytes : {dds::encode(reply), dds::encode(result)}) {
    PendingRequests pending;
    int answered = 0, late = 0;
    const auto count = [&](auto bytes_of_reply) { ++(bytes_of_reply ? answered : late); };
    EXPECT_TRUE(pending.expect(1, 3, 4, 1000, count));
    EXPECT_FALSE(pending.expect(1, 3, 4, 1000, count)) << "the same numbers";
    EXPECT_TRUE(pending.expect(2, 3, 4, 1000, count));
    EXPECT_TRUE(pending.expect(1, 3, 5, 1000, count));
    pending.onReply(1, bytes);
    pending.onReply(1, bytes);
    EXPECT_EQ(answered, 1) << "once";
    pending.cancel(1, 3, 5);
    pending.look(1000 + PendingRequests::kTime - 1);
    EXPECT_EQ(late, 0);
    pending.look(1000 + PendingRequests::kTime);
    EXPECT_EQ(late, 1);
  }
}

dds::DiagnosticArray diagnosticsOf(const std::string& name, const std::vector<dds::KeyValue>& values) {
  dds::DiagnosticArray array;
  array.status.push_back({});
  array.status[0].name = name;
  array.status[0].values = values;
  return array;
}

TEST(ParameterValues, AreThoseThatControlReports) {
  Parameters parameters;
  EXPECT_TRUE(
      parameters.onDiagnostics(diagnosticsOf("tandem-hal", {{"parameter tip_gain", "9"}, {"method", "x"}})).empty());
  const auto report =
      diagnosticsOf("tandem-control", {{"cycles", "7"}, {"method", "hqp"}, {"parameter tip_gain", "3"}});
  EXPECT_EQ(parameters.onDiagnostics(report).size(), 2u);
  EXPECT_TRUE(parameters.onDiagnostics(report).empty()) << "nothing has changed";
  EXPECT_EQ(parameters.get({}), (std::vector<Parameter>{{"method", "hqp"}, {"tip_gain", 3.0}}));
  EXPECT_EQ(parameters.get({"tip_gain", "unknown"}), (std::vector<Parameter>{{"tip_gain", 3.0}}));
  const auto request = requestFor({"tip_gain", 0.1});
  EXPECT_EQ(request.text + "=" + request.value, "tip_gain=0.1");
  EXPECT_EQ(requestFor({"method", "hqp"}).text, "hqp");
  EXPECT_THROW(requestFor({"method", 1.0}), std::invalid_argument);
  EXPECT_THROW(requestFor({"tip_gain", "1"}), std::invalid_argument);
}

/** Requests of clients without DDS: what is published is kept. */
class RequestsOfClients : public ::testing::Test {
 protected:
  RequestsOfClients() {
    std::vector<HubChannel> channels;
    for (const dds::TopicInfo& topic : dds::allTopics({"arm_a", "arm_b"})) {
      if (topic.name == "control/reply")
        replies_ = static_cast<std::uint32_t>(channels.size());
      channels.push_back({static_cast<std::uint32_t>(channels.size()), dds::rosTopicName("t", topic.name), topic});
    }
    requests_ = std::make_unique<RobotRequests>(channels, [this](std::uint32_t, std::string_view cdr) {
      published_.push_back(*dds::decode<dds::ControlRequest>(cdr));
      return problem_;
    });
    requests_->onDiagnostics(diagnosticsOf("tandem-control", {{"method", "hqp"}, {"parameter tip_gain", "3"}}));
  }
  static std::shared_ptr<Client> client(dds::Role role = dds::Role::kConsoleOperator) {
    return std::make_shared<Client>(role, 0.0, [] {});
  }
  /// The next text frame of a client.
  static Json said(const std::shared_ptr<Client>& to) {
    const auto frame = to->queue().pop();
    return frame && frame->kind == FrameKind::kText ? Json::parse(*frame->payload) : Json();
  }
  void reply(const dds::ControlRequest& request, bool accepted) {
    dds::Reply reply;
    reply.client = request.client;
    reply.request = request.request;
    reply.accepted = accepted;
    reply.reason = "because";
    requests_->onReply(replies_, dds::encode(reply));
  }
  static std::string lease(std::uint64_t number) {
    dds::ControlRequest request;
    request.fingerprint = 11;
    request.client = 42;
    request.request = number;
    request.control_session = 12;
    request.answers_control = 13;
    return dds::encode(request);
  }

  std::uint32_t replies_ = 0;
  std::string problem_;
  std::vector<dds::ControlRequest> published_;
  std::unique_ptr<RobotRequests> requests_;
};

TEST_F(RequestsOfClients, ParametersAreSetInTheNameOfTheConnectionsLastRequest) {
  const auto me = client();
  requests_->set(me, {{{"tip_gain", 4.0}}, "1"});
  EXPECT_NE(said(me).at("message").get<std::string>().find("no control lease"), std::string::npos);
  EXPECT_TRUE(published_.empty());
  requests_->note(me, lease(1));
  const auto watcher = client(dds::Role::kConsoleViewer);
  requests_->watch(watcher, {{"tip_gain"}, true});
  EXPECT_EQ(said(watcher).at("parameters")[0].at("value"), 3.0);
  requests_->set(me, {{{"tip_gain", 4.0}, {"unknown", 1.0}}, "2"});
  ASSERT_EQ(published_.size(), 1u);
  EXPECT_EQ(published_[0].fingerprint, 11u);
  EXPECT_EQ(published_[0].client, 42u);
  EXPECT_EQ(published_[0].control_session, 12u);
  EXPECT_EQ(published_[0].answers_control, 13u);
  EXPECT_EQ(said(me).at("message"), "unknown: unknown parameter");
  EXPECT_TRUE(said(me).is_null()) << "the answer waits for control";
  reply(published_[0], true);
  const Json answer = said(me);
  EXPECT_EQ(answer.at("id"), "2");
  EXPECT_EQ(answer.at("parameters").size(), 1u);
  EXPECT_EQ(answer.at("parameters")[0].at("value"), 4.0);
  EXPECT_EQ(said(watcher).at("parameters")[0].at("value"), 4.0);
  requests_->set(me, {{{"tip_gain", 5.0}}, "3"});
  reply(published_[1], false);
  EXPECT_EQ(said(me).at("message"), "tip_gain: because");
  EXPECT_EQ(said(me).at("parameters")[0].at("value"), 4.0) << "the value in force";
  EXPECT_TRUE(said(watcher).is_null());
  requests_->leave(me);
  requests_->set(me, {{{"tip_gain", 5.0}}, "4"});
  EXPECT_EQ(published_.size(), 2u) << "another connection has no name yet";
}

TEST_F(RequestsOfClients, CallsAreAnsweredOrFailWithTheReason) {
  const auto me = client(), viewer = client(dds::Role::kConsoleViewer);
  const std::string request = lease(1);
  const auto failure = [&](const std::shared_ptr<Client>& by, const ServiceCall& call) {
    requests_->call(by, call);
    const Json message = said(by);
    return message.is_null() ? std::string() : message.at("message").get<std::string>();
  };
  const auto names = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(names(failure(me, {99, 1, "cdr", request}), "service 99: unknown"));
  EXPECT_TRUE(names(failure(me, {0, 1, "cdr", request}), "service 0: unknown"));
  EXPECT_TRUE(names(failure(viewer, {1, 1, "cdr", request}), "console-viewer may not call it"));
  EXPECT_TRUE(names(failure(me, {1, 1, "json", request}), "expected cdr"));
  EXPECT_TRUE(names(failure(me, {1, 1, "cdr", "short"}), "expected tandem_msgs/msg/ControlRequest"));
  EXPECT_TRUE(published_.empty());
  EXPECT_EQ(failure(me, {1, 7, "cdr", request}), "");
  EXPECT_TRUE(names(failure(me, {1, 8, "cdr", request}), "under way"));
  ASSERT_EQ(published_.size(), 1u);
  reply(published_[0], true);
  const auto frame = me->queue().pop();
  ASSERT_TRUE(frame && frame->kind == FrameKind::kBinary);
  EXPECT_EQ((*frame->payload)[5], 7) << "the call";
  problem_ = "no subscriber";
  EXPECT_TRUE(names(failure(me, {1, 9, "cdr", lease(2)}), "no subscriber"));
}

TEST(Graph, UpdatesLeadFromOneGraphToTheNext) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto draw = [&random] {
    ConnectionGraph graph;
    for (ConnectionGraph::Ids* side : {&graph.publishers, &graph.subscribers, &graph.providers}) {
      for (unsigned k = 0; k < random() % 6; ++k)
        (*side)["/t/" + std::to_string(random() % 4)].insert("p" + std::to_string(random() % 3));
    }
    return graph;
  };
  ConnectionGraph before;
  std::array<ConnectionGraph::Ids, 3> known;  // as a client knows it
  for (int round = 0; round < 300; ++round) {
    const ConnectionGraph now = draw();
    const Json update = Json::parse(connectionGraphUpdate(before, now));
    EXPECT_EQ(update.at("op"), "connectionGraphUpdate");
    const std::array<std::array<const char*, 2>, 3> members{{{"publishedTopics", "publisherIds"},
                                                             {"subscribedTopics", "subscriberIds"},
                                                             {"advertisedServices", "providerIds"}}};
    for (std::size_t side = 0; side < 3; ++side) {
      for (const Json& entry : update.at(members[side][0])) {
        const auto ids = entry.at(members[side][1]).get<std::set<std::string>>();
        known[side][entry.at("name")] = ids;
        if (ids.empty())
          known[side].erase(entry.at("name"));
      }
    }
    for (const Json& name : update.at("removedTopics")) {
      EXPECT_FALSE(now.publishers.contains(name) || now.subscribers.contains(name));
      EXPECT_TRUE(before.publishers.contains(name) || before.subscribers.contains(name));
    }
    EXPECT_EQ(known[0], now.publishers);
    EXPECT_EQ(known[1], now.subscribers);
    EXPECT_EQ(known[2], now.providers);
    before = now;
  }
}

}  // namespace
}  // namespace tandem::console
