// SPDX-License-Identifier: Apache-2.0
/** @file History of events: the last samples that report one, for pages that connect later. No sockets here. */
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <map>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "services/console/decimation.h"
#include "services/dds/topics.h"

namespace tandem::console {

/** A kept sample. */
struct HistoryEvent {
  std::uint64_t number = 0;  ///< of the kept samples so far, from 1
  std::uint32_t channel = 0;
  HubSample sample;
};

/** Keeps samples of the topics with events, as DDS delivers them. Any thread.
 *
 * The topic that has the most makes room, with its oldest sample: a flood of log lines leaves the faults. */
class History {
 public:
  static constexpr std::size_t kMost = 2000;        ///< samples of all topics
  static constexpr std::size_t kBytes = 4'000'000;  ///< of their payloads

  /// Whether the topic has events: states, faults, stops, ends of runs and processes, lines of logs, identities.
  static bool concerns(const dds::TopicInfo& topic);

  /// Keeps the sample if it has an event: not the same state again, not a repetition of a stop within a second, not a
  /// sample that is delivered once more because its reader is new.
  /// @param features  of the sample
  void take(std::uint32_t channel,
            const dds::TopicInfo& topic,
            const HubSample& sample,
            const SampleFeatures& features);

  /// In the order of their reception, those that are still kept.
  std::vector<HistoryEvent> events() const;
  /// As events(), without the first `known` ones. @param known  becomes taken()
  std::vector<HistoryEvent> eventsAfter(std::uint64_t& known) const;
  /// Number of samples kept so far, also of those that have made room for others.
  std::uint64_t taken() const;
  /// Returns when taken() is another number than `known`, or the end is requested.
  void wait(const std::stop_token& end, std::uint64_t known) const;
  /// All kept samples in the order of their reception, packed as those of a recording (replay.h). @param now  ns
  std::string packed(std::uint64_t now) const;

 private:
  bool isEvent(std::uint32_t channel,
               const dds::TopicInfo& topic,
               const HubSample& sample,
               const SampleFeatures& features);

  bool isKept(std::uint32_t channel, std::string_view bytes) const;
  std::vector<HistoryEvent> after(std::uint64_t number) const;
  void makeRoom();

  /** Of one topic. */
  struct Line {
    std::deque<HistoryEvent> kept;
    std::size_t bytes = 0;
  };

  mutable std::mutex mutex_;
  mutable std::condition_variable_any changed_;
  std::map<std::uint32_t, Line> lines_;  ///< by channel
  std::size_t count_ = 0, bytes_ = 0;    ///< of all
  std::uint64_t taken_ = 0;
  std::map<std::uint32_t, std::uint64_t> states_;  ///< events of the last sample by channel
  std::map<std::uint64_t, std::uint64_t> stops_;   ///< time of the last stop by client
};

}  // namespace tandem::console
