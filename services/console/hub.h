// SPDX-License-Identifier: Apache-2.0
/** @file Message hub between clients of the console and DDS, on serialized samples. No sockets here. */
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "services/console/client_queue.h"
#include "services/console/protocol.h"
#include "services/dds/raw.h"
#include "services/dds/roles.h"

namespace tandem::console {

/** One client, as the hub sees it. */
class Client {
 public:
  /// @param rate  most samples a second of a best-effort topic; 0: all
  /// @param wake  called on any thread when the queue holds something after it was empty
  Client(dds::Role role, double rate, std::function<void()> wake)
      : role_(role), interval_(rate > 0.0 ? static_cast<std::uint64_t>(1e9 / rate) : 0), wake_(std::move(wake)) {}

  dds::Role role() const { return role_; }
  ClientQueue& queue() { return queue_; }
  /// Adds a text frame.
  void sendText(std::string text);
  /// Adds a note for people.
  void note(StatusLevel level, const std::string& message, const std::string& id);

 private:
  friend class Hub;
  dds::Role role_;
  std::uint64_t interval_;  ///< ns
  std::function<void()> wake_;
  ClientQueue queue_;
  std::map<std::uint32_t, std::uint32_t> channels_;       ///< channel by subscription
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  ///< subscription by channel
  std::map<std::uint32_t, std::size_t> publications_;     ///< index of the topic by the client's id
};

/** All channels. Methods are called on one thread, that of the sockets; samples come on those of DDS.
 *
 * A topic is read as long as a client subscribes to it; answers are always read, since whoever asks at once after
 * subscribing wants to receive them. Writers exist from the beginning, for the same reason. */
class Hub {
 public:
  /// @param bytes  a bus of its own, of role console @param arms  names of the robot's arms
  Hub(dds::Bus& bytes, const std::vector<std::string>& arms, const std::string& session);

  /// A client has come: it receives who we are and what there is.
  void join(const std::shared_ptr<Client>& client);
  void leave(const std::shared_ptr<Client>& client);

  /// A frame of a client.
  void onText(const std::shared_ptr<Client>& client, std::string_view frame);
  void onBinary(const std::shared_ptr<Client>& client, std::string_view frame);

  /// Tells clients what their queues have lost since the last call. About once a second.
  void reportDropped();

  std::size_t clients() const { return clients_.size(); }
  std::size_t openReaders() const;
  std::uint64_t received() const { return received_; }    ///< samples from DDS
  std::uint64_t published() const { return published_; }  ///< samples of clients
  std::uint64_t refused() const { return refused_; }      ///< samples and advertisements of clients

 private:
  struct Subscriber {
    std::uint32_t subscription;
    std::shared_ptr<Client> client;
    std::uint64_t due = 0;  ///< before that no sample of a topic that may lose some, ns
  };
  /** One topic. */
  struct Line {
    dds::TopicInfo topic;
    std::string name;  ///< in ROS 2
    bool may_lose = false, latched = false, answers = false;
    dds::Reader reader;
    std::unique_ptr<dds::RawWriter> writer;
    bool open = false;
    std::mutex mutex;  ///< of what follows
    std::vector<Subscriber> subscribers;
    std::shared_ptr<const std::string> last;  ///< of a latched topic
    std::uint64_t last_time = 0;
  };

  void open(std::uint32_t channel);
  void onSample(Line& line, std::uint32_t channel, std::string_view bytes);
  void subscribe(const std::shared_ptr<Client>& client, std::uint32_t subscription, std::uint32_t channel);
  void unsubscribe(const std::shared_ptr<Client>& client, std::uint32_t subscription);
  void detach(const std::shared_ptr<Client>& client, std::uint32_t channel);
  void advertise(const std::shared_ptr<Client>& client, const Advertise::Topic& wanted);

  dds::Bus& bytes_;
  std::vector<std::unique_ptr<Line>> lines_;  ///< by channel
  std::vector<std::shared_ptr<Client>> clients_;
  std::string hello_, advertisement_;
  std::atomic<std::uint64_t> received_{0};
  std::uint64_t published_ = 0, refused_ = 0;
};

}  // namespace tandem::console
