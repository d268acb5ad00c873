// SPDX-License-Identifier: Apache-2.0
/** @file Records of MCAP files (mcap.dev, version 0). Times are ns since the Unix epoch. */
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tandem::recording {

/** An unusable file; what() begins with its name and has position, found and expected values. */
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class Opcode : std::uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd,
};

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHead = 9;  ///< opcode and length

/** Definition of the messages of a channel. */
struct Schema {
  std::uint16_t id = 0;  ///< 0: none
  std::string name;      ///< "sensor_msgs/msg/JointState"
  std::string encoding;  ///< "ros2msg"
  std::string data;      ///< definition, followed by those of its member types
  bool operator==(const Schema&) const = default;
};

/** A stream of messages. Several may have the same topic: Tandem creates one per writer, so that gaps can be counted.
 */
struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;
  std::string topic;
  std::string encoding;  ///< "cdr"
  std::map<std::string, std::string> metadata;
  bool operator==(const Channel&) const = default;
};

/** One message; it does not own its bytes. */
struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0;      ///< time of reception
  std::uint64_t publish_time = 0;  ///< time of writing
  std::string_view data;
};

/** A file inside the recording. */
struct Attachment {
  std::uint64_t log_time = 0;
  std::uint64_t create_time = 0;
  std::string name;
  std::string media_type;
  std::string data;
};

/** Named key-value pairs about the recording. */
struct Metadata {
  std::string name;
  std::map<std::string, std::string> values;
};

/** Number and time range of messages. */
struct Statistics {
  std::uint64_t messages = 0;
  std::uint64_t start = std::numeric_limits<std::uint64_t>::max();  ///< log time of the first message; max: none
  std::uint64_t end = 0;                                            ///< log time of the last message
  std::uint32_t chunks = 0;
  std::map<std::uint16_t, std::uint64_t> per_channel;

  void count(std::uint16_t channel, std::uint64_t time) {
    ++messages;
    ++per_channel[channel];
    start = time < start ? time : start;
    end = time > end ? time : end;
  }
  /// Time from the first to the last message, s.
  double duration() const { return messages == 0 ? 0.0 : 1e-9 * static_cast<double>(end - start); }
};

}  // namespace tandem::recording
