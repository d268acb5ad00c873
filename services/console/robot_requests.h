// SPDX-License-Identifier: Apache-2.0
/** @file Requests of clients to the robot: service calls, and reads and writes of parameters. No sockets here. */
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "services/console/parameters.h"
#include "services/console/pending_requests.h"
#include "services/console/protocol.h"
#include "services/dds/roles.h"

namespace tandem::console {

class Client;

/** A topic as a channel of the hub. */
struct HubChannel {
  std::uint32_t id = 0;
  std::string name;  ///< in ROS 2
  dds::TopicInfo topic;
};

/** Passes requests on as every client publishes them, and matches the replies. A new value of a parameter is a request
 * of the client that has the lease: it is sent in the name, and with the freshness, of the last control/request of the
 * same connection. Methods are called on the thread of the sockets, onReply() and onDiagnostics() on any. */
class RobotRequests {
 public:
  /// Publishes CDR on a channel. @return the problem; empty if there is none
  using Publish = std::function<std::string(std::uint32_t channel, std::string_view cdr)>;

  RobotRequests(const std::vector<HubChannel>& channels, Publish publish);

  /// Services of operators: requests, and the topics of their replies.
  const std::vector<Service>& services() const { return services_; }
  /// Name of the topic of a service's replies.
  const std::string& replyTopic(const Service& service) const { return ends_[service.id - 1].reply_name; }
  /// Channel of control's requests.
  std::uint32_t controlRequests() const { return ends_[0].request; }

  /// A control/request of a client: later values of parameters are sent in its name.
  void note(const std::shared_ptr<Client>& client, std::string_view control_request);
  void call(const std::shared_ptr<Client>& client, const ServiceCall& call);
  void get(const std::shared_ptr<Client>& client, const GetParameters& wanted) const;
  void set(const std::shared_ptr<Client>& client, const SetParameters& wanted);
  void watch(const std::shared_ptr<Client>& client, const WatchParameters& wanted);
  void leave(const std::shared_ptr<Client>& client);

  void onReply(std::uint32_t channel, std::string_view reply) { pending_.onReply(channel, reply); }
  void onDiagnostics(const dds::DiagnosticArray& diagnostics) { publishValues(parameters_.onDiagnostics(diagnostics)); }
  /// Ends the wait for late replies.
  void look(std::uint64_t now) { pending_.look(now); }

 private:
  /** Channels of a service. */
  struct Ends {
    std::uint32_t request = 0, reply = 0;
    dds::TopicInfo topic;  ///< of the requests
    std::string reply_name;
  };
  struct Watcher {
    std::weak_ptr<Client> client;
    bool all = false;
    std::set<std::string> names{};
  };
  struct Change;

  std::string send(const std::shared_ptr<Change>& change, const Parameter& parameter);
  void finish(Change& change) const;
  void accepted(const Parameter& parameter);
  void publishValues(const std::vector<Parameter>& changed);

  Publish publish_;
  std::vector<Service> services_;
  std::vector<Ends> ends_;  ///< by service; that of control first
  PendingRequests pending_;
  Parameters parameters_;
  std::map<const Client*, dds::ControlRequest> last_requests_;
  std::mutex mutex_;  ///< of the watchers
  std::map<const Client*, Watcher> watchers_;
  std::uint64_t next_request_;
};

}  // namespace tandem::console
