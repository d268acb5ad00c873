// SPDX-License-Identifier: Apache-2.0
/** @file Foxglove WebSocket protocol, version 1: parsing and generation of its messages. No sockets here.
 *
 * One protocol with two subprotocol names. Text frames are JSON with a member `op`; binary frames begin with an
 * opcode of one byte; numbers are little-endian. Payloads are plain CDR, described by ROS 2 message definitions.
 */
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace tandem::console {

/// Names of the subprotocol, the preferred one first.
inline constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// The subprotocol to answer a Sec-WebSocket-Protocol header with; empty if the client offers none of them.
std::optional<std::string_view> chooseSubprotocol(std::string_view offered);

/** A topic that a client may subscribe to. */
struct Channel {
  std::uint32_t id = 0;
  std::string topic;       ///< "/tandem/control/status"
  std::string type;        ///< "tandem_msgs/msg/ControlStatus"
  std::string definition;  ///< of the type, schema encoding ros2msg
};

enum class StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };

/// The first message to a client. @param session  new at every start of the server
std::string serverInfo(const std::string& name, const std::string& session);
std::string advertisement(const std::vector<Channel>& channels);
/// A status message for people. @param id  a later one with the same id replaces it
std::string statusNote(StatusLevel level, const std::string& message, const std::string& id);

/// Bytes before a sample's payload.
inline constexpr std::size_t kMessageHeader = 13;
using MessageHeader = std::array<unsigned char, kMessageHeader>;
/// @param subscription  id chosen by the client @param time  of reception of the sample, ns since the epoch
MessageHeader messageHeader(std::uint32_t subscription, std::uint64_t time);

/// Permitted rates, samples per second.
inline constexpr double kLeastRate = 0.1, kMostRate = 1000.0;
inline constexpr const char* kExpectedRate = "rate: expected a number from 0.1 to 1000 samples per second";

/** Requests of a client in text frames. */
struct Subscription {
  std::uint32_t id = 0, channel = 0;
  /// Maximum samples per second of a best-effort topic: `rate`, an addition to the protocol. Empty: that of the
  /// connection.
  std::optional<double> rate = {};
  bool operator==(const Subscription&) const = default;
};
struct Subscribe {
  std::vector<Subscription> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids;
};
struct Advertise {
  struct Topic {
    std::uint32_t id = 0;
    std::string topic, encoding, type;
  };
  std::vector<Topic> topics;
};
struct Unadvertise {
  std::vector<std::uint32_t> ids;
};
/** A parameter: numbers, and texts. */
struct Parameter {
  std::string name;
  std::variant<double, std::string> value;
  bool operator==(const Parameter&) const = default;
};
struct GetParameters {
  std::vector<std::string> names;  ///< none: all
  std::optional<std::string> id;   ///< repeated in the answer
};
struct SetParameters {
  std::vector<Parameter> parameters;
  std::optional<std::string> id;  ///< repeated in the answer; without it there is no answer
};
struct WatchParameters {
  std::vector<std::string> names;  ///< none: all
  bool watch = true;               ///< false: the updates end
};
struct WatchGraph {
  bool watch = true;
};
/** A frame that this server cannot parse. */
struct ProtocolError {
  std::string why;
};
using ClientText = std::variant<Subscribe,
                                Unsubscribe,
                                Advertise,
                                Unadvertise,
                                GetParameters,
                                SetParameters,
                                WatchParameters,
                                WatchGraph,
                                ProtocolError>;

/// Longest text frame that is parsed, bytes.
inline constexpr std::size_t kMaxClientText = 256 * 1024;
/// Maximum number of subscriptions or topics in one text frame.
inline constexpr std::size_t kMaxEntries = 1000;

/// Parses a text frame; never throws.
ClientText parseText(std::string_view text) noexcept;

/** A sample published by a client; `payload` points into the frame. */
struct ClientMessage {
  std::uint32_t topic = 0;  ///< id of its advertisement
  std::string_view payload;
};
/// Parses a binary frame; empty if it is not a message.
std::optional<ClientMessage> parseBinary(std::string_view frame) noexcept;

/** A call of a service; the texts point into the frame. */
struct ServiceCall {
  std::uint32_t service = 0, call = 0;
  std::string_view encoding, payload;
};
/// Parses a binary frame; empty if it is not a call.
std::optional<ServiceCall> parseServiceCall(std::string_view frame) noexcept;

/** A service that clients may call. */
struct Service {
  std::uint32_t id = 0;
  std::string name;                              ///< "/tandem/control/request"
  std::string request_type, request_definition;  ///< as of a Channel
  std::string reply_type, reply_definition;
};

std::string parameterValues(const std::vector<Parameter>& parameters, const std::optional<std::string>& id);
std::string serviceAdvertisement(const std::vector<Service>& services);
/// A binary frame. @param reply  CDR
std::string serviceResponse(const ServiceCall& call, std::string_view reply);
std::string serviceFailure(const ServiceCall& call, const std::string& why);

}  // namespace tandem::console
