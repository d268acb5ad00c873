// SPDX-License-Identifier: Apache-2.0
#include "services/console/pending_requests.h"

#include <array>
#include <utility>
#include <vector>

namespace tandem::console {
namespace {

constexpr std::size_t kEncapsulation = 4;

/// Numbers at the beginning of CDR in the byte order that its second byte tells.
template <std::size_t N>
std::optional<std::array<std::uint64_t, N>> leadingNumbers(std::string_view cdr) {
  if (cdr.size() < kEncapsulation + 8 * N)
    return std::nullopt;
  const bool little = (static_cast<unsigned char>(cdr[1]) & 1) != 0;
  std::array<std::uint64_t, N> numbers{};
  for (std::size_t i = 0; i < 8 * N; ++i) {
    const std::size_t place = little ? i % 8 : 7 - i % 8;
    numbers[i / 8] |= std::uint64_t{static_cast<unsigned char>(cdr[kEncapsulation + i])} << (8 * place);
  }
  return numbers;
}

}  // namespace

std::optional<RequestNumbers> numbersOfRequest(std::string_view cdr) {
  const auto found = leadingNumbers<3>(cdr);
  return found ? std::optional(RequestNumbers{(*found)[0], (*found)[1], (*found)[2]}) : std::nullopt;
}

std::optional<RequestNumbers> numbersOfReply(std::string_view cdr) {
  const auto found = leadingNumbers<2>(cdr);
  return found ? std::optional(RequestNumbers{0, (*found)[0], (*found)[1]}) : std::nullopt;
}

bool PendingRequests::expect(std::uint32_t channel,
                             std::uint64_t client,
                             std::uint64_t request,
                             std::uint64_t now,
                             Answered answered) {
  const std::lock_guard lock(mutex_);
  return pending_.size() < kMost &&
         pending_.emplace(Key{channel, client, request}, Pending{now, std::move(answered)}).second;
}

void PendingRequests::cancel(std::uint32_t channel, std::uint64_t client, std::uint64_t request) {
  const std::lock_guard lock(mutex_);
  pending_.erase({channel, client, request});
}

void PendingRequests::onReply(std::uint32_t channel, std::string_view reply) {
  const auto numbers = numbersOfReply(reply);
  if (!numbers)
    return;
  Answered answered;
  {
    const std::lock_guard lock(mutex_);
    const auto found = pending_.find({channel, numbers->client, numbers->request});
    if (found == pending_.end())
      return;
    answered = std::move(found->second.answered);
    pending_.erase(found);
  }
  answered(reply);
}

void PendingRequests::look(std::uint64_t now) {
  std::vector<Answered> late;
  {
    const std::lock_guard lock(mutex_);
    for (auto entry = pending_.begin(); entry != pending_.end();) {
      // A clock that was set back ends the wait, too.
      const bool waits = now >= entry->second.since && now - entry->second.since < kTime;
      if (!waits)
        late.push_back(std::move(entry->second.answered));
      entry = waits ? std::next(entry) : pending_.erase(entry);
    }
  }
  for (const Answered& answered : late)
    answered(std::nullopt);
}

}  // namespace tandem::console
