// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <exception>
#include <stdexcept>

#include "services/dds/ends_detail.h"

namespace tandem::dds::detail {

using eprosima::fastrtps::types::ReturnCode_t;

WriterEnd::WriterEnd(std::shared_ptr<Participant> participant,
                     std::string dds_name,
                     Profile profile,
                     const fast::TypeSupport& type)
    : participant_(std::move(participant)), name_(std::move(dds_name)) {
  auto* topic = participant_->topic(name_, type);
  const auto qos = writerQos(profile, participant_->options(), type->is_plain());
  writer_ = participant_->publisher()->create_datawriter(topic, qos, this);
  if (writer_ == nullptr) {
    throw std::runtime_error("DDS cannot create the writer of topic " + name_ +
                             "; the lines of Fast DDS above name the cause");
  }
}

WriterEnd::~WriterEnd() {
  writer_->set_listener(nullptr);
  participant_->remove(writer_);
}

bool WriterEnd::write(const void* message) {
  try {
    const char* why = writeSample(message);
    if (why == nullptr) {
      ++written_;
      return true;
    }
    problem_.set(name_ + ": " + why);
  } catch (const std::exception& error) {
    problem_.set(error.what());
  }
  ++refused_;
  return false;
}

const char* WriterEnd::hand(void* sample) { return writer_->write(sample) ? nullptr : "DDS rejected the sample"; }

void WriterEnd::on_publication_matched(fast::DataWriter*, const fast::PublicationMatchedStatus& status) {
  matched_ = status.current_count;
}

void WriterEnd::on_offered_incompatible_qos(fast::DataWriter*, const fast::OfferedIncompatibleQosStatus& status) {
  incompatible_ = status.total_count;
  problem_.set(describeIncompatible(name_, status.last_policy_id));
}

ReaderEnd::ReaderEnd(std::shared_ptr<Participant> participant, std::string dds_name)
    : participant_(std::move(participant)), name_(std::move(dds_name)) {}

void ReaderEnd::open(Profile profile, fast::TopicDataType* type, const ReaderOptions& options) {
  const fast::TypeSupport support(type);
  auto* topic = participant_->topic(name_, support);
  const auto qos = readerQos(profile, participant_->options(), options, support->is_plain());
  senders_ = options.senders;
  reader_ = participant_->subscriber()->create_datareader(topic, qos, this);
  if (reader_ == nullptr) {
    throw std::runtime_error("DDS cannot create the reader of topic " + name_ +
                             "; the lines of Fast DDS above name the cause");
  }
}

void ReaderEnd::close() {
  {
    // Waits for a running callback; none starts after it.
    std::lock_guard lock(callback_mutex_);
    closed_ = true;
  }
  reader_->set_listener(nullptr);
  participant_->subscriber()->delete_datareader(reader_);
}

void ReaderEnd::on_data_available(fast::DataReader* reader) {
  std::lock_guard lock(callback_mutex_);
  fast::SampleInfo info;
  while (!closed_ && reader->take_next_sample(target(), &info) == ReturnCode_t::RETCODE_OK) {
    if (info.valid_data) {
      deliverGuarded(info);
    }
  }
}

void ReaderEnd::deliverGuarded(const fast::SampleInfo& info) {
  try {
    if (const char* why = admits(info) ? deliver(info) : "its sender is not in teleoperation.crtk.clients") {
      ++malformed_;
      participant_->noteDropped(name_, why);
      problem_.set(name_ + ": sample dropped: " + why);
    }
  } catch (const std::exception& error) {
    problem_.set(name_ + ": callback failed: " + error.what());
  }
}

bool ReaderEnd::admits(const fast::SampleInfo& info) const {
  return senders_.empty() ||
         std::ranges::find(senders_, participant_->senderOf(info.publication_handle)) != senders_.end();
}

void ReaderEnd::on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) {
  matched_ = status.current_count;
  if (status.current_count_change < 0)
    left(status.last_publication_handle);
}

void ReaderEnd::on_requested_incompatible_qos(fast::DataReader*, const fast::RequestedIncompatibleQosStatus& status) {
  incompatible_ = status.total_count;
  problem_.set(describeIncompatible(name_, status.last_policy_id));
}

void ReaderEnd::on_requested_deadline_missed(fast::DataReader*,
                                             const eprosima::fastrtps::RequestedDeadlineMissedStatus& status) {
  deadline_missed_ = status.total_count;
}

void ReaderEnd::on_sample_lost(fast::DataReader*, const fast::SampleLostStatus& status) { lost_ = status.total_count; }

}  // namespace tandem::dds::detail
