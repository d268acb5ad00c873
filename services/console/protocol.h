// SPDX-License-Identifier: Apache-2.0
/** @file Foxglove WebSocket protocol, version 1: parsing and generation of its messages. No sockets here.
 *
 * One protocol with two names of the subprotocol. Text frames are JSON with a member `op`; binary frames begin with an
 * opcode of one byte; numbers are little-endian. Payloads are plain CDR, described by ROS 2 message definitions.
 */
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace tandem::console {

/// Names of the subprotocol, the preferred one first.
inline constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// The one to answer with to a Sec-WebSocket-Protocol header; nothing where the client offers none of them.
std::optional<std::string_view> chooseSubprotocol(std::string_view offered);

/** What a client may subscribe to. */
struct Channel {
  std::uint32_t id = 0;
  std::string topic;       ///< "/tandem/control/status"
  std::string type;        ///< "tandem_msgs/msg/ControlStatus"
  std::string definition;  ///< of the type, schema encoding ros2msg
};

enum class StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };

/// The first message to a client. @param session  new with every start of the server
std::string serverInfo(const std::string& name, const std::string& session);
std::string advertisement(const std::vector<Channel>& channels);
/// A note for people. @param id  a later note of the same id takes the place of this one
std::string statusNote(StatusLevel level, const std::string& message, const std::string& id);

/// Bytes in front of a sample's payload.
inline constexpr std::size_t kMessageHeader = 13;
using MessageHeader = std::array<unsigned char, kMessageHeader>;
/// @param subscription  id that the client gave @param time  ns since the epoch, when the sample was received
MessageHeader messageHeader(std::uint32_t subscription, std::uint64_t time);

/** What a client asks for. */
struct Subscribe {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> subscriptions;  ///< (id, channel)
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
/** Nothing that this server understands. */
struct ProtocolError {
  std::string why;
};
using ClientText = std::variant<Subscribe, Unsubscribe, Advertise, Unadvertise, ProtocolError>;

/// Longest text frame that is looked at, bytes.
inline constexpr std::size_t kMaxClientText = 256 * 1024;
/// Most subscriptions or topics in one text frame.
inline constexpr std::size_t kMaxEntries = 1000;

/// Reads a text frame; never throws.
ClientText parseText(std::string_view text) noexcept;

/** A sample that a client publishes; `payload` belongs to the frame. */
struct ClientMessage {
  std::uint32_t topic = 0;  ///< id of its advertisement
  std::string_view payload;
};
/// Reads a binary frame; nothing where it is no message.
std::optional<ClientMessage> parseBinary(std::string_view frame) noexcept;

}  // namespace tandem::console
