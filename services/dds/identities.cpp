// SPDX-License-Identifier: Apache-2.0
#include "services/dds/identities.h"

#include <algorithm>

#include "services/dds/validate.h"

namespace tandem::dds::detail {

IdentityReader::IdentityReader(const std::shared_ptr<Participant>& participant)
    : ReaderEnd(participant, ddsTopicName(participant->options().prefix, kIdentity.name)) {
  constexpr int kDepth = 64;  // samples of processes that publish at the same time
  open(kIdentity.profile, new GuardedSupport<Identity>, {kDepth});
}

IdentityReader::~IdentityReader() { close(); }

std::vector<Identity> IdentityReader::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<Identity> known;
  for (const auto& [writer, identity] : known_)
    known.push_back(identity);
  return known;
}

const char* IdentityReader::deliver(const fast::SampleInfo& info) {
  if (!sample_.decoded)
    return "cannot be decoded";
  Identity reported;
  fromWire(sample_, reported);
  if (const char* why = malformed(reported))
    return why;
  countReceived();
  if (reported.session == participant()->options().identity.session)
    return nullptr;
  const std::lock_guard lock(mutex_);
  std::erase_if(known_, [&](const auto& one) { return one.first == info.publication_handle; });
  known_.emplace_back(info.publication_handle, std::move(reported));
  return nullptr;
}

std::optional<Identity> IdentityReader::find(std::uint64_t session) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [writer, identity] : known_) {
    if (identity.session == session)
      return identity;
  }
  const auto found = std::ranges::find(gone_, session, &Identity::session);
  return found == gone_.end() ? std::nullopt : std::optional(*found);
}

void IdentityReader::left(const Handle& writer) {
  constexpr std::size_t kRemembered = 32;
  const std::lock_guard lock(mutex_);
  for (const auto& [from, identity] : known_) {
    if (from == writer)
      gone_.push_front(identity);
  }
  gone_.resize(std::min(gone_.size(), kRemembered));
  std::erase_if(known_, [&](const auto& one) { return one.first == writer; });
}

}  // namespace tandem::dds::detail
