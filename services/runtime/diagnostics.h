// SPDX-License-Identifier: Apache-2.0
/** @file Diagnostics of a service: status on topic `diagnostics` once a second, log on /rosout. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "services/dds/bus.h"
#include "services/runtime/log_topic.h"

namespace tandem::runtime {

/// Keys and values of a message.
using Details = std::vector<dds::KeyValue>;

/// Key of a value that tells of malformed samples is this and the topic's name in DDS.
inline constexpr const char* kDroppedKey = "dropped ";
/// Keys of sentences about those who know another robot or deployment begin with this.
inline constexpr const char* kMismatchKey = "mismatch ";
/// In control's diagnostics: the key of the name of the client that has paused the arms is this and the client's id.
inline constexpr const char* kPausedByKey = "paused_by ";

/** Publishes one DiagnosticStatus of a service, at most once a second and at once when its level changes. For publisher
 * threads. */
class Diagnostics {
 public:
  enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2 };

  Diagnostics(dds::Bus& bus, std::string service, std::string robot);
  ~Diagnostics();
  Diagnostics(const Diagnostics&) = delete;
  Diagnostics& operator=(const Diagnostics&) = delete;

  /// Adds what the bus has dropped as malformed, by topic; new ones are a warning at least, and are logged. Likewise
  /// who knows another robot or deployment: an error.
  /// @param now  ns, for the rate; @param stamp  of the message
  void publish(std::int64_t now, std::int64_t stamp, Level level, const std::string& message, Details values);

 private:
  dds::Bus& bus_;
  std::string service_, robot_;
  dds::Writer<dds::DiagnosticArray> writer_;
  std::shared_ptr<LogTopic> log_;  ///< as long as this lives
  std::int64_t last_ = 0;
  std::uint64_t dropped_ = 0;  ///< samples, reported in the log
  Level last_level_ = Level::kOk;
};

}  // namespace tandem::runtime
