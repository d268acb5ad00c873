// SPDX-License-Identifier: Apache-2.0
#include "services/console/hub.h"

#include <algorithm>
#include <chrono>
#include <set>

#include "services/dds/definitions.h"
#include "services/runtime/clock_request_handler.h"

namespace tandem::console {
namespace {

constexpr int kDepth = 256;  // samples queued by DDS: a quarter of a second of the fastest topics
constexpr std::size_t kMaxPublications = 200;

constexpr int kGraphLooks = 10;  // looks between two updates of the connection graph
constexpr const char* kOwnName = "tandem-console";

/// Whether a topic carries replies to requests.
bool carriesReplies(const dds::TopicInfo& topic) {
  static const std::set<std::string> answers{"tandem_msgs/msg/Reply", "tandem_msgs/msg/ComputationProgress",
                                             "tandem_msgs/msg/ComputationResult", "tandem_msgs/msg/ClockReply"};
  return answers.contains(topic.type);
}

}  // namespace

void Client::send(FrameKind kind, std::string frame) {
  if (queue_.push(ClientQueue::kText, false, {kind, {}, std::make_shared<const std::string>(std::move(frame))}))
    wake_();
}

void Client::sendText(std::string text) {
  if (!session_.empty() && text.starts_with('{'))
    text.insert(1, "\"sessionId\":\"" + session_ + "\",");
  send(FrameKind::kText, std::move(text));
}

void Client::sendBinary(std::string frame) { send(FrameKind::kBinary, std::move(frame)); }

void Client::note(StatusLevel level, const std::string& message, const std::string& id) {
  sendText(statusNote(level, message, id));
}

Hub::Hub(dds::Bus& bytes, History& history, const std::vector<std::string>& arms, const std::string& session)
    : bytes_(bytes), history_(history), session_(session) {
  const std::string& prefix = bytes.options().prefix;
  std::vector<Channel> channels;
  std::vector<HubChannel> of_requests;
  for (const dds::TopicInfo& topic : dds::allTopics(arms)) {
    auto line = std::make_unique<Line>();
    line->topic = topic;
    line->name = dds::rosTopicName(prefix, topic.name);
    line->may_lose = isStream(topic.profile);
    line->latched = topic.profile == dds::Profile::kLatched;
    line->values = topic.type == dds::DiagnosticArray::kType;
    line->kept = History::concerns(topic);
    line->always = line->values || line->kept || carriesReplies(topic);
    if (dds::mayPublish(dds::Role::kConsoleOperator, topic))
      line->writer = std::make_unique<dds::RawWriter>(bytes_, topic);
    channels.push_back(
        {static_cast<std::uint32_t>(lines_.size()), line->name, topic.type, dds::messageDefinition(topic.type)});
    of_requests.push_back({channels.back().id, line->name, topic});
    lines_.push_back(std::move(line));
  }
  requests_ = std::make_unique<RobotRequests>(
      of_requests, [this](std::uint32_t channel, std::string_view cdr) { return publish(channel, cdr); });
  for (std::uint32_t channel = 0; channel < lines_.size(); ++channel) {
    if (lines_[channel]->always)
      open(channel);
  }
  hello_ = serverInfo("tandem-console " + prefix, session);
  advertisement_ = advertisement(channels);
}

void Hub::open(std::uint32_t channel) {
  Line& line = *lines_[channel];
  line.reader =
      dds::rawReader(bytes_, line.topic,
                     [this, &line, channel](const dds::RawSample& sample) { onSample(line, channel, sample.bytes); },
                     {.depth = kDepth});
  line.open = true;
}

void Hub::onSample(Line& line, std::uint32_t channel, std::string_view bytes) {
  ++received_;
  if (line.values) {
    if (const auto diagnostics = dds::decode<dds::DiagnosticArray>(bytes))
      requests_->onDiagnostics(*diagnostics);
  } else if (carriesReplies(line.topic)) {
    requests_->onReply(channel, bytes);
  }
  const auto now = static_cast<std::uint64_t>(runtime::wallNow());
  const std::lock_guard lock(line.mutex);
  if (line.subscribers.empty() && !line.latched && !line.kept)
    return;
  const HubSample sample{std::make_shared<const std::string>(bytes), now};
  std::optional<SampleFeatures> features;
  if (line.kept) {
    features = featuresOf(line.topic.type, bytes);
    history_.take(channel, line.topic, sample, *features);
  }
  for (Subscriber& subscriber : line.subscribers) {
    if (subscriber.decimation.limited() && !features)
      features = featuresOf(line.topic.type, bytes);
    send(line, channel, subscriber, subscriber.decimation.take(sample, features.value_or(SampleFeatures{})));
  }
  if (line.latched) {
    line.last = sample.bytes;
    line.last_time = now;
  }
}

void Hub::send(const Line& line,
               std::uint32_t channel,
               const Subscriber& subscriber,
               const std::vector<HubSample>& samples) {
  for (const HubSample& sample : samples) {
    if (subscriber.client->queue().push(
            channel, line.may_lose,
            {FrameKind::kSample, messageHeader(subscriber.subscription, sample.time), sample.bytes}))
      subscriber.client->wake_();
  }
}

std::string Hub::history() const { return history_.packed(static_cast<std::uint64_t>(runtime::wallNow())); }

void Hub::look() {
  const auto now = static_cast<std::uint64_t>(runtime::wallNow());
  for (std::uint32_t channel = 0; channel < lines_.size(); ++channel) {
    Line& line = *lines_[channel];
    const std::lock_guard lock(line.mutex);
    for (Subscriber& subscriber : line.subscribers)
      send(line, channel, subscriber, subscriber.decimation.look(now));
  }
  requests_->look(now);
  if (++looks_ % kGraphLooks == 0 && !graph_watchers_.empty())
    updateGraph();
}

void Hub::join(const std::shared_ptr<Client>& client) {
  clients_.push_back(client);
  client->sendText(hello_);  // has it
  client->session_ = session_;
  client->sendText(advertisement_);
  if (client->role() == dds::Role::kConsoleOperator)
    client->sendText(serviceAdvertisement(requests_->services()));
}

void Hub::leave(const std::shared_ptr<Client>& client) {
  while (!client->subscriptions_.empty())
    unsubscribe(client, client->subscriptions_.begin()->second);
  std::erase(clients_, client);
  graph_watchers_.erase(client);
  requests_->leave(client);
}

void Hub::subscribe(const std::shared_ptr<Client>& client, const Subscription& wanted) {
  const auto [subscription, channel, rate] = wanted;
  const std::string id = "subscribe/" + std::to_string(subscription);
  if (channel >= lines_.size())
    return client->note(StatusLevel::kError, "channel " + std::to_string(channel) + ": unknown", id);
  if (client->channels_.contains(subscription) || client->subscriptions_.contains(channel))
    return client->note(
        StatusLevel::kWarning,
        lines_[channel]->name + ": already subscribed; expected one subscription per channel, each with its own number",
        id);
  Line& line = *lines_[channel];
  const double limit = line.may_lose ? rate.value_or(client->rate_) : 0.0;
  client->channels_[subscription] = channel;
  client->subscriptions_[channel] = subscription;
  {
    const std::lock_guard lock(line.mutex);
    line.subscribers.push_back(
        {subscription, client, Decimation(limit > 0.0 ? static_cast<std::uint64_t>(1e9 / limit) : 0)});
    // An existing reader has already received the last sample.
    if (line.last && client->queue().push(channel, line.may_lose,
                                          {FrameKind::kSample, messageHeader(subscription, line.last_time), line.last}))
      client->wake_();
  }
  if (line.open)
    return;
  try {
    open(channel);
  } catch (const std::exception& error) {
    unsubscribe(client, subscription);
    client->note(StatusLevel::kError, line.name + ": " + error.what(), id);
  }
}

void Hub::detach(const std::shared_ptr<Client>& client, std::uint32_t channel) {
  Line& line = *lines_[channel];
  bool empty = false;
  {
    const std::lock_guard lock(line.mutex);
    std::erase_if(line.subscribers, [&](const Subscriber& other) { return other.client == client; });
    empty = line.subscribers.empty();
  }
  client->queue().forget(channel);
  if (!empty || line.always)
    return;
  line.reader = {};  // waits for a running callback: not under the mutex
  line.open = false;
  line.last = nullptr;
}

void Hub::unsubscribe(const std::shared_ptr<Client>& client, std::uint32_t subscription) {
  const auto found = client->channels_.find(subscription);
  if (found == client->channels_.end())
    return client->note(StatusLevel::kWarning, "subscription " + std::to_string(subscription) + ": unknown",
                        "subscribe/" + std::to_string(subscription));
  const std::uint32_t channel = found->second;
  client->channels_.erase(found);
  client->subscriptions_.erase(channel);
  detach(client, channel);
}

void Hub::advertise(const std::shared_ptr<Client>& client, const Advertise::Topic& wanted) {
  const auto line =
      std::find_if(lines_.begin(), lines_.end(), [&](const auto& known) { return known->name == wanted.topic; });
  std::string problem;
  if (line == lines_.end())
    problem = "unknown topic";
  else if (!(*line)->writer || !dds::mayPublish(client->role(), (*line)->topic))
    problem = std::string("role ") + dds::name(client->role()) + " may not publish it";
  else if (wanted.encoding != "cdr")
    problem = "found encoding '" + wanted.encoding.substr(0, 40) + "', expected cdr";
  else if (wanted.type != (*line)->topic.type)
    problem = "found type '" + wanted.type.substr(0, 100) + "', expected " + (*line)->topic.type;
  else if (client->publications_.size() >= kMaxPublications)
    problem = "more than " + std::to_string(kMaxPublications) + " topics advertised";
  if (problem.empty()) {
    client->publications_[wanted.id] = static_cast<std::size_t>(line - lines_.begin());
    return;
  }
  ++refused_;
  client->note(StatusLevel::kError, wanted.topic.substr(0, 200) + ": " + problem,
               "publish/" + std::to_string(wanted.id));
}

void Hub::onText(const std::shared_ptr<Client>& client, std::string_view frame) {
  const ClientText said = parseText(frame);
  if (const auto* wanted = std::get_if<Subscribe>(&said)) {
    for (const Subscription& subscription : wanted->subscriptions)
      subscribe(client, subscription);
  } else if (const auto* unwanted = std::get_if<Unsubscribe>(&said)) {
    for (const std::uint32_t subscription : unwanted->ids)
      unsubscribe(client, subscription);
  } else if (const auto* offered = std::get_if<Advertise>(&said)) {
    for (const Advertise::Topic& topic : offered->topics)
      advertise(client, topic);
  } else if (const auto* withdrawn = std::get_if<Unadvertise>(&said)) {
    for (const std::uint32_t id : withdrawn->ids)
      client->publications_.erase(id);
  } else if (const auto* error = std::get_if<ProtocolError>(&said)) {
    ++refused_;
    client->note(StatusLevel::kError, error->why, "text");
  } else {
    onParameterText(client, said);
  }
}

void Hub::onParameterText(const std::shared_ptr<Client>& client, const ClientText& said) {
  if (const auto* asked = std::get_if<GetParameters>(&said))
    requests_->get(client, *asked);
  else if (const auto* given = std::get_if<SetParameters>(&said))
    requests_->set(client, *given);
  else if (const auto* watched = std::get_if<WatchParameters>(&said))
    requests_->watch(client, *watched);
  else if (const auto* graph = std::get_if<WatchGraph>(&said))
    watch(client, *graph);
}

void Hub::watch(const std::shared_ptr<Client>& client, const WatchGraph& wanted) {
  if (!wanted.watch) {
    graph_watchers_.erase(client);
    return;
  }
  updateGraph();
  graph_watchers_.insert(client);
  client->sendText(connectionGraphUpdate({}, graph_));
}

/// Other processes by discovery; this one publishes topics that clients advertise, and reads those of subscribers.
ConnectionGraph Hub::graph() const {
  ConnectionGraph graph;
  std::set<std::string> known;
  for (const auto& line : lines_) {
    known.insert(line->name);
    if (line->open)
      graph.subscribers[line->name].insert(kOwnName);
  }
  for (const auto& client : clients_) {
    for (const auto& [id, channel] : client->publications_)
      graph.publishers[lines_[channel]->name].insert(kOwnName);
  }
  for (const dds::Endpoint& end : bytes_.endpoints()) {
    if (known.contains(end.topic))
      (end.writes ? graph.publishers : graph.subscribers)[end.topic].insert(end.participant);
  }
  for (const Service& service : requests_->services()) {
    if (const auto found = graph.publishers.find(requests_->replyTopic(service)); found != graph.publishers.end())
      graph.providers[service.name] = found->second;
  }
  return graph;
}

void Hub::updateGraph() {
  ConnectionGraph now = graph();
  if (now == graph_)
    return;
  const std::string update = connectionGraphUpdate(graph_, now);
  for (const auto& client : graph_watchers_)
    client->sendText(update);
  graph_ = std::move(now);
}

std::string Hub::publish(std::uint32_t channel, std::string_view cdr) {
  const auto& writer = lines_[channel]->writer;
  const int own_readers = lines_[channel]->open ? 1 : 0;
  const bool sent = writer && writer->write(cdr);
  ++(sent ? published_ : refused_);
  if (!sent)
    return writer ? writer->lastProblem() : "this console may not publish it";
  return writer->matched() <= own_readers ? "no subscriber; is the robot running?" : "";
}

void Hub::onBinary(const std::shared_ptr<Client>& client, std::string_view frame) {
  if (const auto call = parseServiceCall(frame))
    return requests_->call(client, *call);
  const auto message = parseBinary(frame);
  const auto known = message ? client->publications_.find(message->topic) : client->publications_.end();
  if (known == client->publications_.end()) {
    ++refused_;
    return client->note(
        StatusLevel::kError,
        message ? "topic " + std::to_string(message->topic) + ": not advertised, or its advertisement was refused"
                : "binary frame: expected a message (opcode 1, topic, CDR) or a service call (opcode 2)",
        "binary");
  }
  const auto channel = static_cast<std::uint32_t>(known->second);
  if (channel == requests_->controlRequests())
    requests_->note(client, message->payload);
  if (const std::string problem = publish(channel, message->payload); !problem.empty())
    client->note(StatusLevel::kError, lines_[channel]->name + ": " + problem,
                 "publish/" + std::to_string(message->topic));
}

void Hub::reportDropped() {
  for (const auto& client : clients_) {
    for (const auto& [channel, count] : client->queue().takeDropped()) {
      if (channel < lines_.size())
        client->note(StatusLevel::kWarning,
                     lines_[channel]->name + ": " + std::to_string(count) +
                         " samples dropped, because this client reads too slowly",
                     "dropped/" + lines_[channel]->name);
    }
  }
}

std::size_t Hub::openReaders() const {
  return static_cast<std::size_t>(
      std::count_if(lines_.begin(), lines_.end(), [](const auto& line) { return line->open; }));
}

}  // namespace tandem::console
