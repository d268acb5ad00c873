// SPDX-License-Identifier: Apache-2.0
/** @file Frames of a client of the console: text, binary, and the header with its subprotocols; the first byte selects
 * which. What parses is inside its limits, and every refusal can be sent to the client as JSON. */
#include <nlohmann/json.hpp>

#include "services/console/protocol.h"
#include "tests/fuzz/harness.h"

using namespace tandem::console;
using tandem::fuzz::expect;

namespace {

void check(const Subscribe& request) { expect(request.subscriptions.size() <= kMaxEntries, "subscriptions are few"); }
void check(const Unsubscribe& request) { expect(request.ids.size() <= kMaxEntries, "ids are few"); }
void check(const Unadvertise& request) { expect(request.ids.size() <= kMaxEntries, "ids are few"); }
void check(const Advertise& request) {
  expect(request.topics.size() <= kMaxEntries, "topics are few");
  std::vector<Channel> channels;
  for (const auto& topic : request.topics)
    channels.push_back({topic.id, topic.topic, topic.type, topic.encoding});
  const auto sent = nlohmann::json::parse(advertisement(channels));
  expect(sent.at("channels").size() == channels.size(), "a topic's texts can be sent as JSON");
}
void check(const GetParameters& request) { expect(request.names.size() <= kMaxEntries, "names are few"); }
void check(const SetParameters& request) {
  expect(request.parameters.size() <= kMaxEntries, "parameters are few");
  const auto sent = nlohmann::json::parse(parameterValues(request.parameters, request.id));
  expect(sent.at("parameters").size() == request.parameters.size(), "values can be sent as JSON");
}
void check(const WatchParameters& request) { expect(request.names.size() <= kMaxEntries, "names are few"); }
void check(const WatchGraph&) {}
void check(const ProtocolError& error) {
  expect(!error.why.empty(), "a refusal has a reason");
  const auto note = nlohmann::json::parse(statusNote(StatusLevel::kError, error.why, "protocol"));
  expect(note.at("op") == "status" && !note.at("message").get<std::string>().empty(), "a refusal can be sent",
         error.why);
  expect(error.why.size() < 1000, "a refusal is short", error.why);
}

void checkBinary(std::string_view frame) {
  const auto message = parseBinary(frame);
  expect(message.has_value() == (frame.size() >= 5 && frame[0] == 1), "a message has an opcode and an id");
  if (message)
    expect(message->payload == frame.substr(5), "the payload is the rest of the frame");
  if (const auto call = parseServiceCall(frame)) {
    expect(frame[0] == 2 && 13 + call->encoding.size() + call->payload.size() == frame.size(),
           "a call is the whole frame");
    expect(nlohmann::json::parse(serviceFailure(*call, std::string(call->encoding))).contains("message"),
           "a failure can be sent as JSON");
  }
}

void checkOffer(std::string_view offered) {
  if (const auto chosen = chooseSubprotocol(offered))
    expect(offered.find(*chosen) != std::string_view::npos, "the chosen subprotocol is offered", std::string(offered));
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::fuzz::Input input(data, size);
  switch (input.number<std::uint8_t>()) {
    case 'b':
      checkBinary(input.rest());
      break;
    case 'o':
      checkOffer(input.rest());
      break;
    default:
      std::visit([](const auto& request) { check(request); }, parseText(input.rest()));
  }
  return 0;
}
