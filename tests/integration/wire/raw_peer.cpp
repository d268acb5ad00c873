// SPDX-License-Identifier: Apache-2.0
/* Writes invalid samples to every topic: bytes that cannot be decoded, wrong lengths, counts beyond capacity,
 * non-finite numbers, jumping sequences, old stamps, very long texts, and samples of other types. Ends after ROUNDS
 * rounds, or when its standard input closes; then prints one line of JSON.
 *
 *   raw_peer DOMAIN PREFIX SEED ROUNDS ARM...
 */
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "services/dds/participant_detail.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace {

namespace rtps = eprosima::fastrtps::rtps;
namespace fast = eprosima::fastdds::dds;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kEnormous = 3 * 1024 * 1024;  // bytes

/** A type of any name whose samples are bytes, header included. */
class RawType final : public fast::TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 8 * 1024 * 1024;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<Bytes*>(data);
    if (bytes.size() > payload->max_size)
      return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

/** Fills a message with well-formed invalid values. */
class Poison {
 public:
  explicit Poison(std::mt19937_64& random) : random_(random) {
    const double numbers[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity(), 1e308, -1e308};
    number_ = numbers[random_() % std::size(numbers)];
  }

  /// Operator of the member lists: first this message, then the generated one, which is not used.
  template <class T, class W>
  void operator()(T& value, W&) {
    set(value);
  }

 private:
  template <class T>
  void set(T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      value = static_cast<T>(number_);
    } else if constexpr (std::is_same_v<T, bool>) {
      value = random_() % 2 == 1;
    } else if constexpr (std::is_integral_v<T> && sizeof(T) == 1) {
      value = static_cast<T>(random_() % 4);
    } else if constexpr (std::is_integral_v<T>) {
      const T values[] = {0, 1, std::numeric_limits<T>::max(), std::numeric_limits<T>::min(),
                          static_cast<T>(random_())};
      value = values[random_() % std::size(values)];
    } else if constexpr (Listed<T>) {
      poison(value);
    }
  }
  void set(std::string& text) { text.assign(random_() % 3 == 0 ? kEnormous : 50'000, static_cast<char>(0xff)); }
  template <class T, std::size_t N>
  void set(std::array<T, N>& values) {
    for (T& value : values)
      set(value);
  }
  template <class T>
  void set(std::vector<T>& values) {
    values.resize(random_() % 3 == 0 ? 100'000 : 7);
    if constexpr (!Listed<T>) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        if constexpr (!std::is_same_v<T, std::string>)
          set(values[i]);
      }
    }
  }
  template <class M>
  void poison(M& message) {
    typename Wire<M>::Generated unused;
    if constexpr (requires { members(&message, message, unused, *this); })
      members(&message, message, unused, *this);
  }

 public:
  template <class M>
  void fill(M& message) {
    poison(message);
  }

 private:
  std::mt19937_64& random_;
  double number_;
};

template <class M>
Bytes encoded(const M& message) {
  auto wire = std::make_unique<typename Wire<M>::Generated>();
  toWire(message, *wire);
  GuardedSupport<M> support;
  rtps::SerializedPayload_t payload(support.getSerializedSizeProvider(wire.get())());
  support.serialize(wire.get(), &payload);
  return {payload.data, payload.data + payload.length};
}

/** Writer and sample generators of one topic. */
struct Target {
  std::string name;  ///< name of the DDS topic
  fast::DataWriter* writer = nullptr;
  bool is_stop = false;  ///< a stop that can be decoded is valid and takes effect
  std::function<Bytes()> good, poisoned;
};

Bytes header(std::uint8_t second = 1) { return {0, second, 0, 0}; }

/// Bytes that are not a valid sample.
Bytes mangled(const Target& target, std::mt19937_64& random) {
  Bytes bytes = target.good();
  switch (random() % 8) {
    case 0:
      return header();
    case 1:
      bytes.resize(4 + random() % std::max<std::size_t>(1, bytes.size() - 4));
      return bytes;  // truncated
    case 2:
      bytes.resize(bytes.size() + 1 + random() % 4096, 0xa5);
      bytes[1] = 0;  // of the other byte order
      return bytes;
    case 3:
      bytes[1] = static_cast<std::uint8_t>(2 + random() % 250);
      return bytes;  // of an undefined encoding
    case 4: {
      bytes.assign(4 + random() % (random() % 2 == 0 ? 16 : 8192), 0xff);  // small types, too
      bytes[0] = 0;
      bytes[1] = 1;
      return bytes;  // counts and lengths of 2^32 - 1
    }
    case 5:
      for (std::size_t i = 4; i < bytes.size(); ++i)
        bytes[i] = static_cast<std::uint8_t>(random());
      return bytes;
    case 6:
      bytes = header();
      bytes.resize(kEnormous, 0x7f);
      return bytes;
    default:
      return {0};
  }
}

template <class M>
Target target(detail::Participant& participant,
              const Topic<M>& topic,
              const std::string& arm,
              std::mt19937_64& random) {
  Target result;
  const fast::TypeSupport type(new RawType(ddsTypeName(topic.type)));
  result.name = ddsTopicName(participant.options().prefix, topic.name, arm);
  auto* dds_topic = participant.topic(result.name, type);
  auto qos = detail::writerQos(topic.profile, participant.options(), false);
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.ownership_strength().value = 1000;                      // commands are received only from the strongest writer
  qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;  // fragments
  result.writer = participant.publisher()->create_datawriter(dds_topic, qos);
  result.is_stop = std::is_same_v<M, Stop>;
  result.good = [] { return encoded(M{}); };
  result.poisoned = [&random] {
    auto message = std::make_unique<M>();
    Poison(random).fill(*message);
    return encoded(*message);
  };
  return result;
}

/// Samples of one type on topics of another. @return readers that matched them.
int writeMistyped(const BusOptions& options, const std::vector<std::string>& arms) {
  detail::Participant participant(options);
  const std::vector<TopicInfo> topics = allTopics(arms);
  std::vector<fast::DataWriter*> writers;
  for (std::size_t i = 0; i < topics.size(); ++i) {
    std::string other = topics[(i + 1) % topics.size()].type;
    if (other == topics[i].type)
      other = "std_msgs/msg/String";
    const fast::TypeSupport type(new RawType(ddsTypeName(other)));
    auto* topic = participant.topic(ddsTopicName(options.prefix, topics[i].name), type);
    writers.push_back(
        participant.publisher()->create_datawriter(topic, detail::writerQos(topics[i].profile, options, false)));
  }
  int matched = 0;
  for (int round = 0; round < 100; ++round) {
    Bytes bytes = header();
    bytes.resize(200, 1);
    matched = 0;
    for (auto* writer : writers) {
      fast::PublicationMatchedStatus status;
      writer->write(&bytes);
      writer->get_publication_matched_status(status);
      matched += status.total_count;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // limits the rate, not a wait for an event
  }
  return matched;
}

int readersOf(const std::vector<Target>& targets) {
  int readers = 0;
  for (const Target& to : targets) {
    fast::PublicationMatchedStatus status;
    to.writer->get_publication_matched_status(status);
    readers += status.current_count;
  }
  return readers;
}

/// Waits until no further reader was found for 1 s: readers of a process with many of them are found one by one.
void awaitReaders(const std::vector<Target>& targets) {
  constexpr auto kLook = std::chrono::milliseconds(50);
  constexpr int kQuiet = 20, kMost = 400;  // polls
  int before = 0;
  for (int look = 0, quiet = 0; look < kMost && quiet < kQuiet; ++look) {
    std::this_thread::sleep_for(kLook);
    const int readers = readersOf(targets);
    quiet = readers > 0 && readers == before ? quiet + 1 : 0;
    before = readers;
  }
}

int run(int argc, char** argv) {
  if (argc < 5)
    return 2;
  BusOptions options;
  options.name = "raw";
  options.domain = std::atoi(argv[1]);
  options.prefix = argv[2];
  std::mt19937_64 random(std::strtoull(argv[3], nullptr, 10));
  const long rounds = std::atol(argv[4]);
  const std::vector<std::string> arms(argv + 5, argv + argc);
  const int mistyped = writeMistyped(options, arms);

  detail::Participant participant(options);
  std::vector<Target> targets;
  forEachTopic([&](const auto& topic) {
    if (!topic.per_arm)
      targets.push_back(target(participant, topic, "", random));
    for (const std::string& arm : topic.per_arm ? arms : std::vector<std::string>{})
      targets.push_back(target(participant, topic, arm, random));
  });
  // Selected topics only: the load of all topics may hide a sample.
  if (const char* only = std::getenv("TANDEM_RAW_TOPICS")) {
    const std::string wanted = "," + std::string(only) + ",";
    std::erase_if(targets, [&](const Target& to) { return wanted.find("," + to.name + ",") == std::string::npos; });
  }
  awaitReaders(targets);
  std::uint64_t written = 0;
  for (long round = 0; round < rounds; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));  // limits the rate, not a wait for an event
    for (Target& to : targets) {
      const bool poison = !to.is_stop && random() % 3 == 0;
      Bytes bytes = poison ? to.poisoned() : mangled(to, random);
      written += to.writer->write(&bytes) ? 1 : 0;
    }
  }
  std::printf("{\"written\": %llu, \"topics\": %zu, \"matched\": %d, \"mistyped_matched\": %d}\n",
              static_cast<unsigned long long>(written), targets.size(), readersOf(targets), mistyped);
  return 0;
}

}  // namespace
}  // namespace tandem::dds

int main(int argc, char** argv) {
  try {
    return tandem::dds::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "raw_peer: %s\n", error.what());
    return 1;
  }
}
