// SPDX-License-Identifier: Apache-2.0
/** @file Message hub between clients of the console and DDS, on serialized samples. No sockets here. */
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "services/console/client_queue.h"
#include "services/console/connection_graph.h"
#include "services/console/decimation.h"
#include "services/console/history.h"
#include "services/console/protocol.h"
#include "services/console/robot_requests.h"
#include "services/dds/raw.h"
#include "services/dds/roles.h"

namespace tandem::console {

/** One client of the hub. */
class Client {
 public:
  /// @param rate  maximum samples per second of a best-effort topic, unless its subscription has a rate; 0: all
  /// @param wake  called on any thread when the queue becomes non-empty
  Client(dds::Role role, double rate, std::function<void()> wake) : role_(role), rate_(rate), wake_(std::move(wake)) {}

  dds::Role role() const { return role_; }
  ClientQueue& queue() { return queue_; }
  /// Adds a text frame, a JSON object: with the member `sessionId`, by which the page knows messages of another server.
  void sendText(std::string text);
  /// Adds a binary frame that is no sample.
  void sendBinary(std::string frame);
  /// Adds a status message for people.
  void note(StatusLevel level, const std::string& message, const std::string& id);

 private:
  friend class Hub;
  void send(FrameKind kind, std::string frame);

  dds::Role role_;
  double rate_;
  std::function<void()> wake_;
  std::string session_;  ///< of the server, as text; part of each text frame once it is set
  ClientQueue queue_;
  std::map<std::uint32_t, std::uint32_t> channels_;       ///< channel by subscription
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  ///< subscription by channel
  std::map<std::uint32_t, std::size_t> publications_;     ///< index of the topic by advertisement id
};

/** All channels. Methods are called on the thread of the sockets; samples arrive on threads of DDS.
 *
 * The hub reads a topic while a client subscribes to it. It always reads answers, so that a request immediately
 * after a subscription loses none. Writers exist from the beginning, for the same reason. */
class Hub {
 public:
  /// @param bytes  a separate bus, of role console @param history  outlives this @param arms  names of the robot's arms
  Hub(dds::Bus& bytes, History& history, const std::vector<std::string>& arms, const std::string& session);

  /// Adds a client and sends it the server info and all channels.
  void join(const std::shared_ptr<Client>& client);
  void leave(const std::shared_ptr<Client>& client);

  /// A frame received from a client.
  void onText(const std::shared_ptr<Client>& client, std::string_view frame);
  void onBinary(const std::shared_ptr<Client>& client, std::string_view frame);

  /// Sends the last samples of topics of which no newer ones have come, and changes of the connection graph; ends the
  /// wait for replies that are late. Called about ten times a second.
  void look();
  /// Reports to clients the samples that their queues have dropped since the last call. Called about once a second.
  void reportDropped();

  /// The last samples with events, packed (history.h). Any thread.
  std::string history() const;

  std::size_t clients() const { return clients_.size(); }
  std::size_t openReaders() const;
  std::uint64_t received() const { return received_; }    ///< samples from DDS
  std::uint64_t published() const { return published_; }  ///< samples from clients
  std::uint64_t refused() const { return refused_; }      ///< samples and advertisements of clients

 private:
  struct Subscriber {
    std::uint32_t subscription;
    std::shared_ptr<Client> client;
    Decimation decimation;
  };
  /** One topic. */
  struct Line {
    dds::TopicInfo topic;
    std::string name;  ///< in ROS 2
    bool may_lose = false, latched = false;
    bool always = false;  ///< read without subscribers, too: the topic has replies, or values of parameters
    bool values = false;
    bool kept = false;  ///< in the history
    dds::Reader reader;
    std::unique_ptr<dds::RawWriter> writer;
    bool open = false;
    std::mutex mutex;  ///< of the members below
    std::vector<Subscriber> subscribers;
    std::shared_ptr<const std::string> last;  ///< of a latched topic
    std::uint64_t last_time = 0;
  };

  void open(std::uint32_t channel);
  void onSample(Line& line, std::uint32_t channel, std::string_view bytes);
  void send(const Line& line,
            std::uint32_t channel,
            const Subscriber& subscriber,
            const std::vector<HubSample>& samples);
  void subscribe(const std::shared_ptr<Client>& client, const Subscription& wanted);
  void unsubscribe(const std::shared_ptr<Client>& client, std::uint32_t subscription);
  void detach(const std::shared_ptr<Client>& client, std::uint32_t channel);
  void advertise(const std::shared_ptr<Client>& client, const Advertise::Topic& wanted);
  std::string publish(std::uint32_t channel, std::string_view cdr);
  void onParameterText(const std::shared_ptr<Client>& client, const ClientText& said);
  void watch(const std::shared_ptr<Client>& client, const WatchGraph& wanted);
  ConnectionGraph graph() const;
  void updateGraph();

  dds::Bus& bytes_;
  History& history_;
  std::unique_ptr<RobotRequests> requests_;   // before the readers, whose callbacks use both
  std::vector<std::unique_ptr<Line>> lines_;  ///< by channel
  std::vector<std::shared_ptr<Client>> clients_;
  const std::string session_;
  std::string hello_, advertisement_;
  std::set<std::shared_ptr<Client>> graph_watchers_;
  ConnectionGraph graph_;  ///< as they know it
  int looks_ = 0;
  std::atomic<std::uint64_t> received_{0};
  std::uint64_t published_ = 0, refused_ = 0;
};

}  // namespace tandem::console
