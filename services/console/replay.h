// SPDX-License-Identifier: Apache-2.0
/** @file Recordings of one folder as data for the page, which plays them. Reads files: not on the thread of the
 * sockets.
 */
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "recording/reader.h"
#include "services/console/shapes.h"
#include "services/dds/topics.h"
#include "services/recordings/message_upgrader.h"
#include "services/recordings/recorded_system.h"

namespace tandem::console {

/// The beginning of an answer with samples: the time up to which it has all, 8 bytes, ns.
std::string beginSamples(std::uint64_t reached);
/// Bytes of a sample with its channel and time, appended to an answer: its length (4 bytes), then the frame of the
/// WebSocket (protocol.h), whose subscription is the channel.
void appendSample(std::string& answer, std::uint32_t channel, std::uint64_t time, std::string_view cdr);

/** The recordings of a folder. One thread at a time; the last opened file stays open.
 *
 * A recording of another robot or deployment is described by the configuration files in it, if they are complete:
 * their values have the fingerprint that its messages have.
 *
 * All functions throw std::invalid_argument with the reason for a query, name or file that cannot be used: a file
 * outside the folder, one that is no recording of Tandem or lacks its configuration, one whose index or chunks need
 * more than kMemory. Texts of files may have any bytes. */
class Replay {
 public:
  static constexpr std::uint64_t kMemory = 256ull << 20;     ///< bytes of records in memory at a time
  static constexpr std::uint64_t kUnindexed = 512ull << 20;  ///< largest file without an index, bytes
  static constexpr std::size_t kAnswer = 8ull << 20;         ///< bytes of samples in one answer
  static constexpr double kTime = 0.5;                       ///< s for one answer

  /// @param deployment  of the console
  Replay(std::filesystem::path folder, const config::Deployment& deployment, const config::Robot& robot);

  /// Names and sizes, the newest first.
  nlohmann::ordered_json list() const;
  /// Time range, marks, origin, damage, channels and message definitions of a recording, and the description of its
  /// robot (api.h), which is null for the console's own. @param query  file=NAME
  nlohmann::ordered_json describe(std::string_view query);
  /// Samples of present message types, decimated as for a subscriber, in the order of their times but for peaks.
  /// @param query  file=NAME&from=MS&to=MS&rate=R&topics=1,2: ms since the epoch, channels of describe()
  /// @return the time up to which these are all (8 bytes, ns; the answer is limited in size and duration), then samples
  std::string samples(std::string_view query);
  /// Shapes::span() of the recorded robot. @param query  file=NAME and those of Shapes::spanIn()
  std::string span(std::string_view query);

 private:
  struct Opened {
    std::filesystem::path path;
    std::filesystem::file_time_type changed;
    std::uintmax_t size = 0;
    std::unique_ptr<recording::Reader> reader;
    std::unique_ptr<recordings::MessageUpgrader> upgrader;
    std::unique_ptr<recordings::RecordedSystem> other;  ///< null: the console's own robot and deployment
    std::unique_ptr<Shapes> shapes;                     ///< null: nobody has asked yet
    std::vector<dds::TopicInfo> topics;                 ///< the channels of describe()
    std::map<std::uint16_t, std::uint32_t> channels;    ///< index of the topic by channel of the file
  };

  /// @param as_it_is_now  opens it again if it has changed: one that is being recorded is not read anew for each answer
  Opened& open(std::string_view query, bool as_it_is_now);
  std::unique_ptr<recordings::RecordedSystem> otherSystem(recording::Reader& reader) const;

  const std::filesystem::path folder_;
  const config::Deployment& deployment_;
  const config::Robot& robot_;
  Opened opened_;
};

}  // namespace tandem::console
