// SPDX-License-Identifier: Apache-2.0
#include "bench/ping_pong.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>

namespace tandem::bench {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/** Data type of a fixed number of bytes. */
class Bytes final : public fast::TopicDataType {
 public:
  explicit Bytes(std::size_t size) : size_(size) {
    setName(("Bytes" + std::to_string(size)).c_str());
    m_typeSize = static_cast<std::uint32_t>(size + 4);
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    std::memcpy(payload->data, "\0\1\0\0", 4);  // plain CDR, little-endian
    std::memcpy(payload->data + 4, data, size_);
    payload->length = static_cast<std::uint32_t>(size_ + 4);
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    if (payload->length != size_ + 4)
      return false;
    std::memcpy(data, payload->data + 4, size_);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [this] { return m_typeSize; };
  }
  void* createData() override { return new char[size_](); }
  void deleteData(void* data) override { delete[] static_cast<char*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }

 private:
  std::size_t size_;
};

/** One side: writes one topic and reads the other. */
class Side final : public fast::DataReaderListener {
 public:
  Side(int domain, const char* writes, std::size_t size_out, const char* reads, std::size_t size_in)
      : out_(size_out), in_(size_in) {
    fast::DomainParticipantQos qos;
    auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.push_back("127.0.0.1");
    qos.transport().user_transports.push_back(transport);
    qos.transport().use_builtin_transports = false;
    rtps::Locator_t loopback;
    eprosima::fastrtps::rtps::IPLocator::setIPv4(loopback, "127.0.0.1");
    loopback.port = 0;
    qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(loopback);
    qos.wire_protocol().builtin.initialPeersList.push_back(loopback);
    participant_ =
        fast::DomainParticipantFactory::get_instance()->create_participant(static_cast<std::uint32_t>(domain), qos);
    if (participant_ == nullptr)
      throw std::runtime_error("ping-pong: DDS cannot create a participant in domain " + std::to_string(domain));
    fast::DataWriterQos writer;
    writer.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    writer.publish_mode().kind = fast::SYNCHRONOUS_PUBLISH_MODE;
    writer.data_sharing().off();
    fast::DataReaderQos reader;
    reader.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    reader.data_sharing().off();
    fast::Publisher* publisher = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    fast::Subscriber* subscriber = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    writer_ = publisher->create_datawriter(topic(writes, size_out), writer);
    reader_ = subscriber->create_datareader(topic(reads, size_in), reader, this);
  }
  ~Side() override {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  void send() { writer_->write(out_.data()); }
  /// Called on the listener's thread for every sample.
  std::function<void()> received;

  void on_data_available(fast::DataReader* reader) override {
    fast::SampleInfo info;
    while (reader->take_next_sample(in_.data(), &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data && received)
        received();
    }
  }

 private:
  fast::Topic* topic(const char* name, std::size_t size) {
    fast::TypeSupport type(new Bytes(size));
    type.register_type(participant_);
    return participant_->create_topic(name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  }

  std::vector<char> out_, in_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::DataWriter* writer_ = nullptr;
  fast::DataReader* reader_ = nullptr;
};

[[noreturn]] void answer(int domain, std::size_t there, std::size_t back) {
  Side side(domain, "back", back, "there", there);
  side.received = [&side] { side.send(); };
  for (;;)
    pause();
}

}  // namespace

std::vector<double> pingPong(int domain, std::size_t there, std::size_t back, int trips) {
  const pid_t child = fork();
  if (child == 0)
    answer(domain, there, back);
  std::mutex mutex;
  std::condition_variable came;
  long received = 0;
  std::vector<double> times;
  {
    Side side(domain, "there", there, "back", back);
    side.received = [&] {
      const std::lock_guard lock(mutex);
      ++received;
      came.notify_one();
    };
    const auto once = [&](double seconds) {
      std::unique_lock lock(mutex);
      const long before = received;
      lock.unlock();
      const auto begin = std::chrono::steady_clock::now();
      side.send();
      lock.lock();
      const bool answered =
          came.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return received > before; });
      times.push_back(1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
      return answered;
    };
    bool answered = false;
    for (int i = 0; i < 100 && !answered; ++i)  // until both sides are matched
      answered = once(0.1);
    times.clear();
    for (int i = 0; i < trips && answered; ++i)
      answered = once(2.0);
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  if (static_cast<int>(times.size()) < trips)
    throw std::runtime_error("ping-pong: found " + std::to_string(times.size()) + " replies, expected " +
                             std::to_string(trips));
  return times;
}

}  // namespace tandem::bench
