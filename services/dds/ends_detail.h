// SPDX-License-Identifier: Apache-2.0
/** @file Private: type-independent base of writers and readers: matching, counters, error reports, shutdown. */
#pragma once

#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "services/dds/participant_detail.h"

namespace tandem::dds::detail {

/** The last problem of an endpoint, written by any thread. */
class Problem {
 public:
  void set(std::string text) {
    std::lock_guard lock(mutex_);
    text_ = std::move(text);
  }
  std::string get() const {
    std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

/** Base of writers; a subclass converts messages to DDS samples. */
class WriterEnd : public WriterBase, private fast::DataWriterListener {
 public:
  /// @throw std::runtime_error if DDS refuses.
  WriterEnd(std::shared_ptr<Participant> participant,
            std::string dds_name,
            Profile profile,
            const fast::TypeSupport& type);
  ~WriterEnd() override;

  bool write(const void* message) final;
  WriterStatistics statistics() const final { return {matched_, written_, refused_, incompatible_}; }
  std::string lastProblem() const final { return problem_.get(); }

 protected:
  /// Calls hand(). @return defect of the message, or null.
  virtual const char* writeSample(const void* message) = 0;
  /// Passes a sample to DDS. @return reason of a refusal, or null.
  const char* hand(void* sample);

 private:
  void on_publication_matched(fast::DataWriter*, const fast::PublicationMatchedStatus& status) override;
  void on_offered_incompatible_qos(fast::DataWriter*, const fast::OfferedIncompatibleQosStatus& status) override;

  std::shared_ptr<Participant> participant_;
  std::string name_;
  fast::DataWriter* writer_ = nullptr;
  std::atomic<int> matched_{0};
  std::atomic<std::uint64_t> written_{0}, refused_{0}, incompatible_{0};
  Problem problem_;
};

/** Base of readers; a subclass supplies the sample storage and processes samples. Its constructor calls open(), its
 * destructor close(); samples are received in between. */
class ReaderEnd : public ReaderBase, private fast::DataReaderListener {
 public:
  ReaderEnd(std::shared_ptr<Participant> participant, std::string dds_name);

  ReaderStatistics statistics() const final {
    return {matched_, received_, malformed_, incompatible_, deadline_missed_, lost_};
  }
  std::string lastProblem() const final { return problem_.get(); }

 protected:
  /// Storage of the next sample.
  virtual void* target() = 0;
  /// Checks the sample, calls countReceived() and passes it on. @return reason for dropping it, or null.
  virtual const char* deliver(const fast::SampleInfo& info) = 0;
  /// A writer is no longer matched.
  virtual void left(const eprosima::fastrtps::rtps::InstanceHandle_t& /*writer*/) {}

  /// @throw std::runtime_error if DDS refuses.
  void open(Profile profile, fast::TopicDataType* type, const ReaderOptions& options);
  void close();
  void countReceived() { ++received_; }
  const std::shared_ptr<Participant>& participant() const { return participant_; }
  const std::string& name() const { return name_; }

 private:
  void on_data_available(fast::DataReader* reader) override;
  void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override;
  void on_requested_incompatible_qos(fast::DataReader*, const fast::RequestedIncompatibleQosStatus& status) override;
  void on_requested_deadline_missed(fast::DataReader*,
                                    const eprosima::fastrtps::RequestedDeadlineMissedStatus& status) override;
  void on_sample_lost(fast::DataReader*, const fast::SampleLostStatus& status) override;
  void deliverGuarded(const fast::SampleInfo& info);
  bool admits(const fast::SampleInfo& info) const;

  std::shared_ptr<Participant> participant_;
  std::string name_;
  fast::DataReader* reader_ = nullptr;
  std::vector<std::string> senders_;  ///< as in ReaderOptions
  std::mutex callback_mutex_;
  bool closed_ = false;
  std::atomic<int> matched_{0};
  std::atomic<std::uint64_t> received_{0}, malformed_{0}, incompatible_{0}, deadline_missed_{0}, lost_{0};
  Problem problem_;
};

}  // namespace tandem::dds::detail
