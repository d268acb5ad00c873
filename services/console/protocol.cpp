// SPDX-License-Identifier: Apache-2.0
#include "services/console/protocol.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace tandem::console {
namespace {

using Json = nlohmann::json;

constexpr unsigned char kMessageData = 0x01;    // from the server
constexpr unsigned char kClientMessage = 0x01;  // from a client
constexpr unsigned char kServiceCall = 0x02;    // from a client
constexpr unsigned char kServiceReply = 0x03;   // from the server
constexpr std::size_t kClientHeader = 5;
constexpr std::size_t kServiceHeader = 13;  // before the name of the encoding

/// Texts of clients may be invalid UTF-8: invalid bytes are replaced.
std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

template <class T>
void writeLittleEndian(unsigned char* to, T value) {
  for (std::size_t i = 0; i < sizeof value; ++i)
    to[i] = static_cast<unsigned char>(value >> (8 * i));
}

std::uint32_t readNumber(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < sizeof value; ++i)
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
  return value;
}

std::uint32_t number(const Json& value, const char* what) {
  if (value.is_number_unsigned() && value.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max())
    return value.get<std::uint32_t>();
  throw std::invalid_argument(std::string(what) + ": expected an integer from 0 to 4294967295");
}

std::string text(const Json& entry, const char* key) {
  const auto found = entry.find(key);
  if (found == entry.end() || !found->is_string())
    throw std::invalid_argument(std::string(key) + ": expected a string");
  return found->get<std::string>();
}

const Json& member(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  if (found == object.end())
    throw std::invalid_argument(std::string(key) + ": is missing");
  return *found;
}

const Json& list(const Json& object, const char* key) {
  const Json& found = member(object, key);
  if (!found.is_array() || found.size() > kMaxEntries)
    throw std::invalid_argument(std::string(key) + ": expected a list of at most " + std::to_string(kMaxEntries) +
                                " entries");
  return found;
}

std::vector<std::uint32_t> numbers(const Json& object, const char* key) {
  std::vector<std::uint32_t> found;
  for (const Json& entry : list(object, key))
    found.push_back(number(entry, key));
  return found;
}

std::vector<std::string> names(const Json& object, const char* key) {
  std::vector<std::string> found;
  for (const Json& entry : list(object, key)) {
    if (!entry.is_string())
      throw std::invalid_argument(std::string(key) + ": expected names");
    found.push_back(entry.get<std::string>());
  }
  return found;
}

std::optional<std::string> optionalText(const Json& object, const char* key) {
  return object.contains(key) ? std::optional(text(object, key)) : std::nullopt;
}

SetParameters parseSet(const Json& json) {
  SetParameters request{{}, optionalText(json, "id")};
  for (const Json& entry : list(json, "parameters")) {
    Parameter& parameter = request.parameters.emplace_back(Parameter{text(entry, "name"), 0.0});
    const Json& value = member(entry, "value");
    if (value.is_number())
      parameter.value = value.get<double>();
    else if (value.is_string())
      parameter.value = value.get<std::string>();
    else
      throw std::invalid_argument(parameter.name.substr(0, 100) + ": value: expected a number or a text");
  }
  return request;
}

std::optional<double> rate(const Json& subscription) {
  const auto found = subscription.find("rate");
  if (found == subscription.end())
    return std::nullopt;
  if (!found->is_number() || found->get<double>() < kLeastRate || found->get<double>() > kMostRate)
    throw std::invalid_argument(kExpectedRate);
  return found->get<double>();
}

ClientText parse(std::string_view frame) {
  if (frame.size() > kMaxClientText)
    throw std::invalid_argument("WebSocket message: found " + std::to_string(frame.size()) +
                                " bytes of text, expected at most " + std::to_string(kMaxClientText));
  const Json json = Json::parse(frame, nullptr, false);
  if (!json.is_object())
    throw std::invalid_argument("WebSocket message: found no JSON object, expected one with the key op");
  const std::string op = text(json, "op");
  if (op == "subscribe") {
    Subscribe request;
    for (const Json& entry : list(json, "subscriptions")) {
      const std::uint32_t id = number(member(entry, "id"), "id");
      request.subscriptions.push_back({id, number(member(entry, "channelId"), "channelId"), rate(entry)});
    }
    return request;
  }
  if (op == "unsubscribe")
    return Unsubscribe{numbers(json, "subscriptionIds")};
  if (op == "advertise") {
    Advertise request;
    for (const Json& entry : list(json, "channels"))
      request.topics.push_back({number(member(entry, "id"), "id"), text(entry, "topic"), text(entry, "encoding"),
                                text(entry, "schemaName")});
    return request;
  }
  if (op == "unadvertise")
    return Unadvertise{numbers(json, "channelIds")};
  if (op == "getParameters")
    return GetParameters{names(json, "parameterNames"), optionalText(json, "id")};
  if (op == "setParameters")
    return parseSet(json);
  if (op == "subscribeParameterUpdates" || op == "unsubscribeParameterUpdates")
    return WatchParameters{names(json, "parameterNames"), op.starts_with("s")};
  if (op == "subscribeConnectionGraph" || op == "unsubscribeConnectionGraph")
    return WatchGraph{op.starts_with("s")};
  return ProtocolError{"op '" + op.substr(0, 40) +
                       "': expected subscribe, unsubscribe, advertise, unadvertise, getParameters, setParameters, "
                       "(un)subscribeParameterUpdates or (un)subscribeConnectionGraph"};
}

}  // namespace

std::optional<std::string_view> chooseSubprotocol(std::string_view offered) {
  for (std::string_view ours : kSubprotocols) {
    for (std::size_t begin = 0; begin <= offered.size();) {
      const std::size_t end = std::min(offered.find(',', begin), offered.size());
      std::string_view word = offered.substr(begin, end - begin);
      while (word.starts_with(' ') || word.starts_with('\t'))
        word.remove_prefix(1);
      while (word.ends_with(' ') || word.ends_with('\t'))
        word.remove_suffix(1);
      if (word == ours)
        return ours;
      begin = end + 1;
    }
  }
  return std::nullopt;
}

std::string serverInfo(const std::string& name, const std::string& session) {
  return dump({{"op", "serverInfo"},
               {"name", name},
               {"capabilities", {"clientPublish", "parameters", "parametersSubscribe", "services", "connectionGraph"}},
               {"supportedEncodings", {"cdr"}},
               {"metadata", {{"ROS_DISTRO", "humble"}}},
               {"sessionId", session}});
}

std::string advertisement(const std::vector<Channel>& channels) {
  Json list = Json::array();
  for (const Channel& channel : channels)
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", "cdr"},
                    {"schemaName", channel.type},
                    {"schema", channel.definition},
                    {"schemaEncoding", "ros2msg"}});
  return dump({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string statusNote(StatusLevel level, const std::string& message, const std::string& id) {
  return dump({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}, {"id", id}});
}

MessageHeader messageHeader(std::uint32_t subscription, std::uint64_t time) {
  MessageHeader header{kMessageData};
  writeLittleEndian(header.data() + 1, subscription);
  writeLittleEndian(header.data() + 5, time);
  return header;
}

ClientText parseText(std::string_view frame) noexcept {
  try {
    return parse(frame);
  } catch (const std::exception& error) {
    return ProtocolError{error.what()};
  }
}

std::optional<ClientMessage> parseBinary(std::string_view frame) noexcept {
  if (frame.size() < kClientHeader || static_cast<unsigned char>(frame[0]) != kClientMessage)
    return std::nullopt;
  return ClientMessage{readNumber(frame.substr(1)), frame.substr(kClientHeader)};
}

std::optional<ServiceCall> parseServiceCall(std::string_view frame) noexcept {
  if (frame.size() < kServiceHeader || static_cast<unsigned char>(frame[0]) != kServiceCall)
    return std::nullopt;
  const std::size_t encoding = readNumber(frame.substr(9));
  if (encoding > frame.size() - kServiceHeader)
    return std::nullopt;
  return ServiceCall{readNumber(frame.substr(1)), readNumber(frame.substr(5)), frame.substr(kServiceHeader, encoding),
                     frame.substr(kServiceHeader + encoding)};
}

std::string parameterValues(const std::vector<Parameter>& parameters, const std::optional<std::string>& id) {
  Json values = Json::array();
  for (const Parameter& parameter : parameters) {
    Json& entry = values.emplace_back(Json{{"name", parameter.name}});
    if (const auto* value = std::get_if<double>(&parameter.value)) {
      entry["value"] = *value;
      entry["type"] = "float64";
    } else {
      entry["value"] = std::get<std::string>(parameter.value);
    }
  }
  Json message{{"op", "parameterValues"}, {"parameters", std::move(values)}};
  if (id)
    message["id"] = *id;
  return dump(message);
}

std::string serviceAdvertisement(const std::vector<Service>& services) {
  const auto side = [](const std::string& type, const std::string& definition) {
    return Json{{"encoding", "cdr"}, {"schemaName", type}, {"schemaEncoding", "ros2msg"}, {"schema", definition}};
  };
  Json list = Json::array();
  for (const Service& service : services)
    list.push_back({{"id", service.id},
                    {"name", service.name},
                    {"type", service.request_type},
                    {"request", side(service.request_type, service.request_definition)},
                    {"response", side(service.reply_type, service.reply_definition)}});
  return dump({{"op", "advertiseServices"}, {"services", std::move(list)}});
}

std::string serviceResponse(const ServiceCall& call, std::string_view reply) {
  constexpr std::string_view kEncoding = "cdr";
  std::array<unsigned char, kServiceHeader> header{kServiceReply};
  writeLittleEndian(header.data() + 1, call.service);
  writeLittleEndian(header.data() + 5, call.call);
  writeLittleEndian(header.data() + 9, static_cast<std::uint32_t>(kEncoding.size()));
  std::string frame(header.begin(), header.end());
  return frame.append(kEncoding).append(reply);
}

std::string serviceFailure(const ServiceCall& call, const std::string& why) {
  return dump({{"op", "serviceCallFailure"}, {"serviceId", call.service}, {"callId", call.call}, {"message", why}});
}

}  // namespace tandem::console
