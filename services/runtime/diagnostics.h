// SPDX-License-Identifier: Apache-2.0
/** @file Diagnostics of a service: status on topic `diagnostics` once a second, log on /rosout. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "services/dds/bus.h"
#include "services/runtime/log_topic.h"
#include "services/runtime/process.h"
#include "services/runtime/ros_time.h"

namespace tandem::runtime {

/// Keys and values of a message.
using Details = std::vector<dds::KeyValue>;

/// Key of the number of malformed samples: this prefix and the topic's name in DDS.
inline constexpr const char* kDroppedKey = "dropped ";
/// Prefix of the keys that describe processes of another robot or deployment.
inline constexpr const char* kMismatchKey = "mismatch ";
/// Prefix of the keys that name devices that have failed; the value says why. Each is an error of the message, too.
inline constexpr const char* kFailedKey = "failed ";
/// Name of control's status in the diagnostics.
inline constexpr const char* kControl = "tandem-control";
/// In control's diagnostics, key of the name of the client that has paused the arms: this prefix and the client's id.
inline constexpr const char* kPausedByKey = "paused_by ";
/// Prefix of the message with which a service ends; the reason follows.
inline constexpr const char* kEnded = "ended: ";
/// In control's diagnostics, key of the present value of a parameter of the method: this prefix and its name.
inline constexpr const char* kParameterKey = "parameter ";
/// In planning's diagnostics, key of the name of the last trajectory: this prefix and its id in planning/reference.
inline constexpr const char* kTrajectoryKey = "trajectory ";

/** Publishes one DiagnosticStatus of a service, at most once a second and at once when its level changes. For publisher
 * threads. */
class Diagnostics {
 public:
  enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };

  Diagnostics(dds::Bus& bus, const Setup& setup);
  /// Publishes that the service ends, and why.
  ~Diagnostics();
  Diagnostics(const Diagnostics&) = delete;
  Diagnostics& operator=(const Diagnostics&) = delete;

  /// Adds the numbers of malformed samples that the bus has dropped, by topic; new ones are at least a warning, and are
  /// logged. Also adds processes of another robot or deployment, as an error, and to the message what has failed
  /// (kFailedKey).
  /// @param instant  that the message describes: see RosTime
  void publish(std::int64_t instant, Level level, const std::string& message, Details values);

 private:
  void write(std::int64_t stamp, Level level, const std::string& message, Details values);

  dds::Bus& bus_;
  std::string service_, robot_;
  dds::Writer<dds::DiagnosticArray> writer_;
  RosTime time_;
  std::shared_ptr<LogTopic> log_;  ///< a log sink during the lifetime of this object
  std::int64_t last_ = 0;
  std::uint64_t dropped_ = 0;  ///< samples, reported in the log
  Level last_level_ = Level::kOk;
};

}  // namespace tandem::runtime
