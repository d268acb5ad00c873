// SPDX-License-Identifier: Apache-2.0
#include "services/console/robot_requests.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "services/console/hub.h"
#include "services/dds/definitions.h"
#include "services/dds/raw.h"
#include "services/runtime/clock_request_handler.h"

namespace tandem::console {
namespace {

/// Topics of requests and of their replies, below the prefix.
constexpr std::array<std::array<std::string_view, 2>, 5> kServices{{{"control/request", "control/reply"},
                                                                    {"planning/request", "planning/reply"},
                                                                    {"planning/compute", "planning/result"},
                                                                    {"hal/request", "hal/reply"},
                                                                    {"sim/request", "sim/reply"}}};
/// First number of the server's own requests: clients count theirs from 1.
constexpr std::uint64_t kFirstRequest = std::uint64_t{1} << 63;

std::uint64_t now() { return static_cast<std::uint64_t>(runtime::wallNow()); }

/// "NAME: reason"; some reasons begin with the name.
std::string about(const Parameter& parameter, const std::string& reason) {
  const std::string name = parameter.name.substr(0, 100) + ": ";
  return reason.starts_with(name) ? reason : name + reason;
}

const HubChannel& channelOf(const std::vector<HubChannel>& channels, std::string_view topic) {
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [&](const HubChannel& known) { return known.topic.name == topic; });
  if (found == channels.end())
    throw std::logic_error("no channel for " + std::string(topic));
  return *found;
}

}  // namespace

/** A setParameters under way. */
struct RobotRequests::Change {
  std::weak_ptr<Client> client;
  dds::ControlRequest request;  ///< the last one of the client
  SetParameters wanted;
  std::atomic<std::size_t> open{0};  ///< replies that are awaited, and one until all are sent
};

RobotRequests::RobotRequests(const std::vector<HubChannel>& channels, Publish publish)
    : publish_(std::move(publish)), next_request_(kFirstRequest) {
  for (const auto& [request_topic, reply_topic] : kServices) {
    const HubChannel &request = channelOf(channels, request_topic), &reply = channelOf(channels, reply_topic);
    ends_.push_back({request.id, reply.id, request.topic, reply.name});
    services_.push_back({static_cast<std::uint32_t>(ends_.size()), request.name, request.topic.type,
                         dds::messageDefinition(request.topic.type), reply.topic.type,
                         dds::messageDefinition(reply.topic.type)});
  }
}

void RobotRequests::note(const std::shared_ptr<Client>& client, std::string_view control_request) {
  if (const auto request = dds::decode<dds::ControlRequest>(control_request))
    last_requests_[client.get()] = *request;
}

void RobotRequests::call(const std::shared_ptr<Client>& client, const ServiceCall& call) {
  const auto fail = [&](const std::string& why) { client->sendText(serviceFailure(call, why)); };
  if (call.service == 0 || call.service > ends_.size())
    return fail("service " + std::to_string(call.service) + ": unknown, expected 1 to " + std::to_string(ends_.size()));
  const Ends& ends = ends_[call.service - 1];
  const std::string& name = services_[call.service - 1].name;
  if (!dds::mayPublish(client->role(), ends.topic))
    return fail(name + ": role " + dds::name(client->role()) + " may not call it");
  if (call.encoding != "cdr")
    return fail(name + ": found encoding '" + std::string(call.encoding.substr(0, 40)) + "', expected cdr");
  const auto numbers = numbersOfRequest(call.payload);
  if (!numbers || numbers->client == 0)
    return fail(name + ": expected " + ends.topic.type + " with the number of a client that is not 0");
  const ServiceCall id{call.service, call.call, {}, {}};
  const auto answered = [weak = std::weak_ptr(client), id, name](std::optional<std::string_view> reply) {
    const auto caller = weak.lock();
    if (!caller)
      return;
    if (reply)
      caller->sendBinary(serviceResponse(id, *reply));
    else
      caller->sendText(serviceFailure(id, name + ": no reply within 5 s; is the robot running?"));
  };
  if (!pending_.expect(ends.reply, numbers->client, numbers->request, now(), answered))
    return fail(name + ": a request with this number is under way; expected a new number for each request");
  if (&ends == ends_.data())
    note(client, call.payload);
  if (const std::string problem = publish_(ends.request, call.payload); !problem.empty()) {
    pending_.cancel(ends.reply, numbers->client, numbers->request);
    fail(name + ": " + problem);
  }
}

void RobotRequests::get(const std::shared_ptr<Client>& client, const GetParameters& wanted) const {
  client->sendText(parameterValues(parameters_.get(wanted.names), wanted.id));
}

void RobotRequests::set(const std::shared_ptr<Client>& client, const SetParameters& wanted) {
  const auto last = last_requests_.find(client.get());
  if (last == last_requests_.end())
    return client->note(StatusLevel::kError,
                        "setParameters: this connection has no control lease; acquire it with a control/request first",
                        "parameters");
  const auto change = std::make_shared<Change>();
  change->client = client;
  change->request = last->second;
  change->wanted = wanted;
  change->open = 1;
  for (const Parameter& parameter : wanted.parameters) {
    if (const std::string problem = send(change, parameter); !problem.empty())
      client->note(StatusLevel::kError, about(parameter, problem), "parameters");
  }
  finish(*change);
}

std::string RobotRequests::send(const std::shared_ptr<Change>& change, const Parameter& parameter) {
  if (!parameters_.knows(parameter.name))
    return "unknown parameter";
  dds::ControlRequest request;
  try {
    request = requestFor(parameter);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  request.fingerprint = change->request.fingerprint;
  request.client = change->request.client;
  request.control_session = change->request.control_session;
  request.answers_control = change->request.answers_control;
  request.request = next_request_++;
  const auto answered = [this, change, parameter](std::optional<std::string_view> bytes) {
    const auto reply = bytes ? dds::decode<dds::Reply>(*bytes) : std::nullopt;
    if (reply && reply->accepted != 0)
      accepted(parameter);
    else if (const auto client = change->client.lock())
      client->note(StatusLevel::kError, about(parameter, reply ? reply->reason : "control did not reply within 5 s"),
                   "parameters");
    finish(*change);
  };
  ++change->open;
  const std::uint32_t replies = ends_[0].reply;
  std::string problem = "too many requests are under way";
  if (pending_.expect(replies, request.client, request.request, now(), answered)) {
    problem = publish_(ends_[0].request, dds::encode(request));
    if (problem.empty())
      return problem;
    pending_.cancel(replies, request.client, request.request);
  }
  --change->open;
  return problem;
}

/// One reply less is awaited; after the last one the client gets the values, if it has asked for them.
void RobotRequests::finish(Change& change) const {
  if (--change.open > 0 || !change.wanted.id)
    return;
  std::vector<std::string> names;
  for (const Parameter& parameter : change.wanted.parameters)
    names.push_back(parameter.name);
  if (const auto client = change.client.lock())
    client->sendText(
        parameterValues(names.empty() ? std::vector<Parameter>{} : parameters_.get(names), change.wanted.id));
}

void RobotRequests::accepted(const Parameter& parameter) {
  parameters_.set(parameter);
  publishValues({parameter});
}

void RobotRequests::watch(const std::shared_ptr<Client>& client, const WatchParameters& wanted) {
  {
    const std::lock_guard lock(mutex_);
    Watcher& watcher = watchers_[client.get()];
    watcher.client = client;
    if (wanted.names.empty())
      watcher = {client, wanted.watch, {}};
    for (const std::string& name : wanted.names) {
      if (wanted.watch)
        watcher.names.insert(name);
      else
        watcher.names.erase(name);
    }
    if (!watcher.all && watcher.names.empty())
      watchers_.erase(client.get());
  }
  if (wanted.watch)
    client->sendText(parameterValues(parameters_.get(wanted.names), std::nullopt));
}

void RobotRequests::publishValues(const std::vector<Parameter>& changed) {
  if (changed.empty())
    return;
  const std::lock_guard lock(mutex_);
  for (const auto& entry : watchers_) {
    const auto& watcher = entry.second;
    std::vector<Parameter> wanted;
    std::copy_if(changed.begin(), changed.end(), std::back_inserter(wanted),
                 [&](const Parameter& p) { return watcher.all || watcher.names.contains(p.name); });
    const auto client = watcher.client.lock();
    if (client && !wanted.empty())
      client->sendText(parameterValues(wanted, std::nullopt));
  }
}

void RobotRequests::leave(const std::shared_ptr<Client>& client) {
  last_requests_.erase(client.get());
  const std::lock_guard lock(mutex_);
  watchers_.erase(client.get());
}

}  // namespace tandem::console
