// SPDX-License-Identifier: Apache-2.0
/** @file Private: one Fast DDS participant, its topics, and the quality of service of each profile. */
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <mutex>
#include <string>

#include "services/dds/bus.h"
#include "services/dds/endpoint_list.h"

namespace tandem::dds::detail {

namespace fast = eprosima::fastdds::dds;

/** Owns the participant; shared by the Bus and all its readers and writers, so that it is destroyed last. */
class Participant : private fast::DomainParticipantListener {
 public:
  explicit Participant(const BusOptions& options);
  ~Participant() override;
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// The DDS topic of this name, created on first use. @throw std::runtime_error if it exists with another type.
  fast::Topic* topic(const std::string& dds_name, const fast::TypeSupport& type);

  fast::Publisher* publisher() { return publisher_; }
  /** Deletes a writer of publisher(), its samples first: Fast DDS before 2.12.2 releases them without a lock while its
   * event thread may iterate over them for a heartbeat, which then never ends (Fast DDS, pull request 4076). */
  void remove(fast::DataWriter* writer);
  fast::Subscriber* subscriber() { return subscriber_; }
  const BusOptions& options() const { return options_; }

  /// Name of the participant of this writer; empty if unknown.
  std::string senderOf(const eprosima::fastrtps::rtps::InstanceHandle_t& writer) const;

  /// Writers and readers of all other participants.
  std::vector<Endpoint> endpoints() const {
    const std::lock_guard lock(names_mutex_);
    return endpoints_.all(names_);
  }

  void noteDropped(const std::string& topic, const char* why);
  std::vector<Dropped> dropped() const;
  void onMismatch(std::function<void(const Mismatch&)> handler);
  void noteMismatch(const Mismatch& mismatch) const;

 private:
  void on_participant_discovery(fast::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;
  void on_subscriber_discovery(fast::DomainParticipant*,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& found) override {
    endpoints_.note(found.info.guid(), found.info.topicName().to_string(), false,
                    found.status == eprosima::fastrtps::rtps::ReaderDiscoveryInfo::REMOVED_READER);
  }
  void on_publisher_discovery(fast::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& found) override {
    endpoints_.note(found.info.guid(), found.info.topicName().to_string(), true,
                    found.status == eprosima::fastrtps::rtps::WriterDiscoveryInfo::REMOVED_WRITER);
  }

  BusOptions options_;
  mutable std::mutex names_mutex_;
  std::map<eprosima::fastrtps::rtps::GuidPrefix_t, std::string> names_;  ///< of other participants
  EndpointList endpoints_;
  std::mutex mutex_;
  mutable std::mutex dropped_mutex_;
  std::vector<Dropped> dropped_;
  mutable std::mutex mismatch_mutex_;
  std::function<void(const Mismatch&)> mismatch_handler_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::Publisher* publisher_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
};

/// Quality of service of a writer; `plain` types have a fixed size.
fast::DataWriterQos writerQos(Profile profile, const BusOptions& options, bool plain);

/// Quality of service of a reader.
fast::DataReaderQos readerQos(Profile profile, const BusOptions& options, const ReaderOptions& reader, bool plain);

/// "another process on topic TOPIC was rejected: different reliability ...".
std::string describeIncompatible(const std::string& topic, std::uint32_t policy);

}  // namespace tandem::dds::detail
