// SPDX-License-Identifier: Apache-2.0
/** @file Private: one Fast DDS participant, its topics, and the quality of service of each profile. */
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <mutex>
#include <string>

#include "services/dds/bus.h"

namespace tandem::dds::detail {

namespace fast = eprosima::fastdds::dds;

/** Owns the participant; shared by the Bus and all its endpoints, so that it goes last. */
class Participant {
 public:
  explicit Participant(const BusOptions& options);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// The DDS topic of this name, created on first use. @throw std::runtime_error where its type differs from before.
  fast::Topic* topic(const std::string& dds_name, const fast::TypeSupport& type);

  fast::Publisher* publisher() { return publisher_; }
  fast::Subscriber* subscriber() { return subscriber_; }
  const BusOptions& options() const { return options_; }

  void noteDropped(const std::string& topic, const char* why);
  std::vector<Dropped> dropped() const;

 private:
  BusOptions options_;
  std::mutex mutex_;
  mutable std::mutex dropped_mutex_;
  std::vector<Dropped> dropped_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::Publisher* publisher_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
};

/// Quality of service of a writer; `plain` types have a fixed size.
fast::DataWriterQos writerQos(Profile profile, const BusOptions& options, bool plain);

/// Quality of service of a reader.
fast::DataReaderQos readerQos(Profile profile, const BusOptions& options, const ReaderOptions& reader, bool plain);

/// "another end of TOPIC was refused: its RELIABILITY differs".
std::string describeIncompatible(const std::string& topic, std::uint32_t policy);

}  // namespace tandem::dds::detail
