// SPDX-License-Identifier: Apache-2.0
#include "services/dds/bus.h"

#include <mutex>
#include <stdexcept>

#include "services/dds/ends_detail.h"
#include "services/dds/identities.h"
#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace detail {
namespace {

/// Messages with a fingerprint: accepted only from senders with the same robot.
template <class M>
concept Fingerprinted = !std::is_same_v<M, Identity> && requires(M message) {
  message.fingerprint;
};

template <class M>
std::string topicName(const Participant& participant, const Topic<M>& topic, const std::string& arm) {
  if (topic.per_arm == arm.empty()) {
    throw std::invalid_argument(std::string("topic ") + topic.name +
                                (topic.per_arm ? " is published per arm; pass the name of an arm"
                                               : " is not published per arm; pass no name of an arm"));
  }
  return ddsTopicName(participant.options().prefix, topic.name, arm);
}

template <class M>
class WriterImpl final : public WriterEnd {
 public:
  WriterImpl(std::shared_ptr<Participant> participant, const Topic<M>& topic, const std::string& arm)
      : WriterEnd(participant,
                  topicName(*participant, topic, arm),
                  topic.profile,
                  fast::TypeSupport(new GuardedSupport<M>)),
        fingerprint_(participant->options().identity.fingerprint) {}

 private:
  const char* writeSample(const void* message) override {
    const M& ours = *static_cast<const M*>(message);
    if (const char* why = malformed(ours))
      return why;
    std::lock_guard lock(mutex_);
    toWire(ours, wire_);
    if constexpr (Fingerprinted<M>) {
      if (fingerprint_ != 0)
        wire_.fingerprint(fingerprint_);
    }
    return hand(&wire_);
  }

  std::uint64_t fingerprint_;
  std::mutex mutex_;
  typename Wire<M>::Generated wire_;  // reused, so that fixed-size messages allocate nothing
};

template <class M>
class ReaderImpl final : public ReaderEnd {
 public:
  using Callback = std::function<void(const M&)>;

  ReaderImpl(std::shared_ptr<Participant> participant,
             const Topic<M>& topic,
             const std::string& arm,
             Callback callback,
             const ReaderOptions& options)
      : ReaderEnd(participant, topicName(*participant, topic, arm)), callback_(std::move(callback)) {
    open(topic.profile, new GuardedSupport<M>, options);
  }
  ~ReaderImpl() override { close(); }

 private:
  void* target() override { return static_cast<typename Wire<M>::Generated*>(&sample_); }

  const char* deliver(const fast::SampleInfo&) override {
    if (!sample_.decoded)
      return "cannot be decoded";
    fromWire(sample_, message_);
    if (isMismatch())
      return nullptr;
    if (const char* why = malformed(message_))
      return why;
    countReceived();
    callback_(message_);
    return nullptr;
  }

  bool isMismatch() const {
    if constexpr (Fingerprinted<M>) {
      const std::uint64_t ours = participant()->options().identity.fingerprint;
      if (ours == 0 || message_.fingerprint == ours)
        return false;
      Mismatch mismatch{name(), message_.fingerprint};
      if constexpr (requires { message_.client; })
        mismatch = {name(), message_.fingerprint, message_.client, message_.request};
      participant()->noteMismatch(mismatch);
      return true;
    }
    return false;
  }

  Callback callback_;
  Sample<M> sample_;
  M message_;
};

}  // namespace
}  // namespace detail

Bus::Bus(const BusOptions& options) : participant_(std::make_shared<detail::Participant>(options)) {
  if (options.identity.fingerprint == 0)
    return;
  others_ = std::make_unique<detail::IdentityReader>(participant_);
  identity_ = writer(kIdentity);
  identity_.write(options.identity);
}

Bus::~Bus() { onMismatch({}); }

std::vector<Endpoint> Bus::endpoints() const { return participant_->endpoints(); }
std::vector<Identity> Bus::others() const { return others_ ? others_->all() : std::vector<Identity>{}; }

std::optional<Identity> Bus::identityOf(std::uint64_t session) const {
  return others_ ? others_->find(session) : std::nullopt;
}

void Bus::onMismatch(std::function<void(const Mismatch&)> handler) { participant_->onMismatch(std::move(handler)); }

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
