// SPDX-License-Identifier: Apache-2.0
#include "services/dds/raw.h"

#include <stdexcept>

#include "services/dds/ends_detail.h"
#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace detail {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

constexpr std::size_t kEncapsulation = 4;  // bytes in front of CDR

/** Type support for serialized samples of a type known by name only. A writer's sample is a string_view, a reader's a
 * string. */
class RawSupport final : public fast::TopicDataType {
 public:
  explicit RawSupport(const std::string& dds_type) {
    setName(dds_type.c_str());
    m_typeSize = kUsualPayload;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }

  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const std::string_view*>(data);
    if (bytes.size() > payload->max_size)
      return false;
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = static_cast<unsigned char>(bytes[1]);
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload->data), payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const std::string_view*>(data)->size()); };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

const char* wrong(std::string_view bytes) {
  return bytes.size() < kEncapsulation ? "is not CDR: shorter than the encapsulation header"
         : bytes.size() > kMaxPayload  ? "is longer than the largest permitted sample"
                                       : nullptr;
}

class RawWriterImpl final : public WriterEnd {
 public:
  RawWriterImpl(const std::shared_ptr<Participant>& participant, const TopicInfo& topic)
      : WriterEnd(participant,
                  ddsTopicName(participant->options().prefix, topic.name),
                  topic.profile,
                  fast::TypeSupport(new RawSupport(ddsTypeName(topic.type)))) {}

 private:
  const char* writeSample(const void* message) override {
    std::string_view bytes = *static_cast<const std::string_view*>(message);
    const char* why = wrong(bytes);
    return why ? why : hand(&bytes);
  }
};

class RawReaderImpl final : public ReaderEnd {
 public:
  RawReaderImpl(const std::shared_ptr<Participant>& participant,
                const TopicInfo& topic,
                std::function<void(const RawSample&)> callback,
                const ReaderOptions& options)
      : ReaderEnd(participant, ddsTopicName(participant->options().prefix, topic.name)),
        callback_(std::move(callback)),
        own_prefix_(participant->subscriber()->get_participant()->guid().guidPrefix) {
    open(topic.profile, new RawSupport(ddsTypeName(topic.type)), options);
  }
  ~RawReaderImpl() override { close(); }

 private:
  void* target() override { return &bytes_; }

  const char* deliver(const fast::SampleInfo& info) override {
    if (const char* why = wrong(bytes_))
      return why;
    RawSample sample{bytes_, info.source_timestamp.to_ns(), 0, {}, false};
    sample.sequence = info.sample_identity.sequence_number().to64long();
    const auto& writer = info.sample_identity.writer_guid();
    std::copy_n(writer.guidPrefix.value, 12, sample.writer.begin());
    std::copy_n(writer.entityId.value, 4, sample.writer.begin() + 12);
    sample.own = writer.guidPrefix == own_prefix_;
    countReceived();
    callback_(sample);
    return nullptr;
  }

  std::function<void(const RawSample&)> callback_;
  eprosima::fastrtps::rtps::GuidPrefix_t own_prefix_;
  std::string bytes_;
};

}  // namespace
}  // namespace detail

RawWriter::RawWriter(Bus& bus, const TopicInfo& topic)
    : base_(std::make_unique<detail::RawWriterImpl>(bus.participant(), topic)) {}

Reader rawReader(Bus& bus,
                 const TopicInfo& topic,
                 std::function<void(const RawSample&)> callback,
                 const ReaderOptions& options) {
  return Reader(std::make_unique<detail::RawReaderImpl>(bus.participant(), topic, std::move(callback), options));
}

template <class M>
std::optional<M> decode(std::string_view bytes) {
  if (detail::wrong(bytes))
    return std::nullopt;
  detail::SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = payload.max_size;
  Sample<M> sample;
  GuardedSupport<M> support;
  support.deserialize(&payload, static_cast<typename Wire<M>::Generated*>(&sample));
  if (!sample.decoded)
    return std::nullopt;
  std::optional<M> message(std::in_place);
  fromWire(sample, *message);
  return malformed(*message) ? std::nullopt : std::move(message);
}

template <class M>
std::string encode(const M& message) {
  typename Wire<M>::Generated wire;
  toWire(message, wire);
  GuardedSupport<M> support;
  detail::SerializedPayload_t payload(support.getSerializedSizeProvider(&wire)());
  if (!support.serialize(&wire, &payload))
    throw std::runtime_error("a message cannot be encoded");
  return {reinterpret_cast<const char*>(payload.data), payload.length};
}

#define TANDEM_INSTANTIATE(M)                            \
  template std::optional<M> decode<M>(std::string_view); \
  template std::string encode<M>(const M&);
TANDEM_EACH_MESSAGE(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::dds
