// SPDX-License-Identifier: Apache-2.0
/** @file Requests that wait for a reply, and the numbers that match replies to them. Without sockets. */
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <tuple>

namespace tandem::console {

/** The first members of a serialized request: fingerprint, client, request. Replies and results begin with the last
 * two. */
struct RequestNumbers {
  std::uint64_t fingerprint = 0, client = 0, request = 0;
};
/// Numbers in a serialized request; empty if it is too short.
std::optional<RequestNumbers> numbersOfRequest(std::string_view cdr);
/// Numbers in a serialized reply; fingerprint is 0. Empty if it is too short.
std::optional<RequestNumbers> numbersOfReply(std::string_view cdr);

/** Requests by channel of the reply, client and request. Any thread. */
class PendingRequests {
 public:
  /// @param reply  serialized; empty if none has come in time. Called on any thread, once, outside of the mutex.
  using Answered = std::function<void(std::optional<std::string_view> reply)>;

  static constexpr std::uint64_t kTime = 5'000'000'000;  ///< ns for which a reply is awaited
  static constexpr std::size_t kMost = 1000;             ///< requests at a time

  /// @param now  ns since the epoch @return false if a request with these numbers waits already, or too many wait
  bool expect(std::uint32_t channel, std::uint64_t client, std::uint64_t request, std::uint64_t now, Answered answered);
  /// Forgets a request that was not sent.
  void cancel(std::uint32_t channel, std::uint64_t client, std::uint64_t request);
  void onReply(std::uint32_t channel, std::string_view reply);
  /// Ends the wait for requests without reply.
  void look(std::uint64_t now);

 private:
  struct Pending {
    std::uint64_t since;
    Answered answered;
  };
  using Key = std::tuple<std::uint32_t, std::uint64_t, std::uint64_t>;

  std::mutex mutex_;
  std::map<Key, Pending> pending_;
};

}  // namespace tandem::console
