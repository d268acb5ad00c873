// SPDX-License-Identifier: Apache-2.0
#include "services/dds/bus.h"

#include <atomic>
#include <exception>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <mutex>
#include <stdexcept>

#include "services/dds/participant_detail.h"
#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace detail {
namespace {

using eprosima::fastrtps::types::ReturnCode_t;

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

template <class M>
std::string topicName(const Participant& participant, const Topic<M>& topic, const std::string& arm) {
  if (topic.per_arm == arm.empty()) {
    throw std::invalid_argument(std::string("topic ") + topic.name +
                                (topic.per_arm ? " belongs to an arm: name one" : " belongs to no arm"));
  }
  return ddsTopicName(participant.options().prefix, topic.name, arm);
}

template <class M>
class WriterImpl final : public WriterBase, private fast::DataWriterListener {
 public:
  WriterImpl(std::shared_ptr<Participant> participant, const Topic<M>& topic, const std::string& arm)
      : participant_(std::move(participant)), name_(topicName(*participant_, topic, arm)) {
    const fast::TypeSupport type(new GuardedSupport<M>);
    auto* dds_topic = participant_->topic(name_, type);
    const auto qos = writerQos(topic.profile, participant_->options(), type->is_plain());
    writer_ = participant_->publisher()->create_datawriter(dds_topic, qos, this);
    if (writer_ == nullptr) {
      throw std::runtime_error("DDS refuses a writer of " + name_);
    }
  }

  ~WriterImpl() override {
    writer_->set_listener(nullptr);
    participant_->publisher()->delete_datawriter(writer_);
  }

  bool write(const void* message) override {
    try {
      return writeMessage(*static_cast<const M*>(message));
    } catch (const std::exception& error) {
      ++refused_;
      problem_.set(error.what());
      return false;
    }
  }

  WriterStatistics statistics() const override { return {matched_, written_, refused_, incompatible_}; }
  std::string lastProblem() const override { return problem_.get(); }

 private:
  bool writeMessage(const M& message) {
    const char* why = malformed(message);
    if (why == nullptr) {
      std::lock_guard lock(mutex_);
      toWire(message, wire_);
      if (writer_->write(&wire_)) {
        ++written_;
        return true;
      }
      why = "DDS did not take the sample";
    }
    ++refused_;
    problem_.set(name_ + ": " + why);
    return false;
  }

  void on_publication_matched(fast::DataWriter*, const fast::PublicationMatchedStatus& status) override {
    matched_ = status.current_count;
  }
  void on_offered_incompatible_qos(fast::DataWriter*, const fast::OfferedIncompatibleQosStatus& status) override {
    incompatible_ = status.total_count;
    problem_.set(describeIncompatible(name_, status.last_policy_id));
  }

  std::shared_ptr<Participant> participant_;
  std::string name_;
  fast::DataWriter* writer_ = nullptr;
  std::mutex mutex_;
  typename Wire<M>::Generated wire_;  // reused, so that fixed-size messages allocate nothing
  std::atomic<int> matched_{0};
  std::atomic<std::uint64_t> written_{0}, refused_{0}, incompatible_{0};
  Problem problem_;
};

template <class M>
class ReaderImpl final : public ReaderBase, private fast::DataReaderListener {
 public:
  using Callback = std::function<void(const M&)>;

  ReaderImpl(std::shared_ptr<Participant> participant,
             const Topic<M>& topic,
             const std::string& arm,
             Callback callback,
             const ReaderOptions& options)
      : participant_(std::move(participant)),
        name_(topicName(*participant_, topic, arm)),
        callback_(std::move(callback)) {
    const fast::TypeSupport type(new GuardedSupport<M>);
    auto* dds_topic = participant_->topic(name_, type);
    const auto qos = readerQos(topic.profile, participant_->options(), options, type->is_plain());
    reader_ = participant_->subscriber()->create_datareader(dds_topic, qos, this);
    if (reader_ == nullptr) {
      throw std::runtime_error("DDS refuses a reader of " + name_);
    }
  }

  ~ReaderImpl() override {
    {
      // Waits for a running callback; none starts after it.
      std::lock_guard lock(callback_mutex_);
      closed_ = true;
    }
    reader_->set_listener(nullptr);
    participant_->subscriber()->delete_datareader(reader_);
  }

  ReaderStatistics statistics() const override {
    return {matched_, received_, malformed_, incompatible_, deadline_missed_, lost_};
  }
  std::string lastProblem() const override { return problem_.get(); }

 private:
  void on_data_available(fast::DataReader* reader) override {
    std::lock_guard lock(callback_mutex_);
    fast::SampleInfo info;
    auto* target = static_cast<typename Wire<M>::Generated*>(&sample_);
    while (!closed_ && reader->take_next_sample(target, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) {
        deliver();
      }
    }
  }

  void deliver() {
    const char* why = "cannot be decoded";
    if (sample_.decoded) {
      fromWire(sample_, message_);
      why = malformed(message_);
    }
    if (why != nullptr) {
      ++malformed_;
      participant_->noteDropped(name_, why);
      problem_.set(name_ + ": sample dropped: " + why);
      return;
    }
    ++received_;
    try {
      callback_(message_);
    } catch (const std::exception& error) {
      problem_.set(name_ + ": callback failed: " + error.what());
    }
  }

  void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
    matched_ = status.current_count;
  }
  void on_requested_incompatible_qos(fast::DataReader*, const fast::RequestedIncompatibleQosStatus& status) override {
    incompatible_ = status.total_count;
    problem_.set(describeIncompatible(name_, status.last_policy_id));
  }
  void on_requested_deadline_missed(fast::DataReader*,
                                    const eprosima::fastrtps::RequestedDeadlineMissedStatus& status) override {
    deadline_missed_ = status.total_count;
  }
  void on_sample_lost(fast::DataReader*, const fast::SampleLostStatus& status) override { lost_ = status.total_count; }

  std::shared_ptr<Participant> participant_;
  std::string name_;
  Callback callback_;
  fast::DataReader* reader_ = nullptr;
  std::mutex callback_mutex_;
  bool closed_ = false;
  Sample<M> sample_;
  M message_;
  std::atomic<int> matched_{0};
  std::atomic<std::uint64_t> received_{0}, malformed_{0}, incompatible_{0}, deadline_missed_{0}, lost_{0};
  Problem problem_;
};

}  // namespace
}  // namespace detail

Bus::Bus(const BusOptions& options) : participant_(std::make_shared<detail::Participant>(options)) {}
Bus::~Bus() = default;

const BusOptions& Bus::options() const { return participant_->options(); }

std::vector<Dropped> Bus::dropped() const { return participant_->dropped(); }

template <class M>
Writer<M> Bus::writer(const Topic<M>& topic, const std::string& arm) {
  return Writer<M>(std::make_unique<detail::WriterImpl<M>>(participant_, topic, arm));
}

template <class M>
Reader Bus::reader(const Topic<M>& topic,
                   const std::string& arm,
                   std::function<void(const std::type_identity_t<M>&)> callback,
                   const ReaderOptions& options) {
  return Reader(std::make_unique<detail::ReaderImpl<M>>(participant_, topic, arm, std::move(callback), options));
}

#define TANDEM_INSTANTIATE(M)                                                                        \
  template Writer<M> Bus::writer<M>(const Topic<M>&, const std::string&);                            \
  template Reader Bus::reader<M>(const Topic<M>&, const std::string&, std::function<void(const M&)>, \
                                 const ReaderOptions&);
TANDEM_EACH_MESSAGE(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::dds
