// SPDX-License-Identifier: Apache-2.0
#include "services/console/history.h"

#include <algorithm>
#include <set>
#include <utility>

#include "services/console/replay.h"
#include "services/dds/raw.h"
#include "services/runtime/diagnostics.h"

namespace tandem::console {
namespace {

constexpr std::uint64_t kAgain = 1'000'000'000;  // ns within which a stop is a repetition
constexpr std::size_t kMostClients = 100;

bool saysAnEnd(std::string_view bytes) {
  const auto diagnostics = dds::decode<dds::DiagnosticArray>(bytes);
  return diagnostics && std::any_of(diagnostics->status.begin(), diagnostics->status.end(),
                                    [](const auto& status) { return status.message.starts_with(runtime::kEnded); });
}

}  // namespace

bool History::concerns(const dds::TopicInfo& topic) {
  static const std::set<std::string> names{"control/status", "hal/status", "planning/summary", "stop",
                                           "identity",       "/rosout",    "diagnostics"};
  return names.contains(topic.name);
}

bool History::isEvent(std::uint32_t channel,
                      const dds::TopicInfo& topic,
                      const HubSample& sample,
                      const SampleFeatures& features) {
  if (topic.type == dds::ControlStatus::kType || topic.type == dds::HalStatus::kType) {
    const auto [last, first] = states_.try_emplace(channel, features.events);
    return first || std::exchange(last->second, features.events) != features.events;
  }
  if (topic.profile == dds::Profile::kLatched && isKept(channel, *sample.bytes))
    return false;
  if (topic.type == dds::DiagnosticArray::kType)
    return saysAnEnd(*sample.bytes);
  if (topic.type != dds::Stop::kType)
    return true;
  const auto stop = dds::decode<dds::Stop>(*sample.bytes);
  if (!stop)
    return false;
  if (stops_.size() > kMostClients)
    stops_.clear();
  const auto [last, first] = stops_.try_emplace(stop->client, sample.time);
  return first || sample.time - std::exchange(last->second, sample.time) > kAgain;
}

bool History::isKept(std::uint32_t channel, std::string_view bytes) const {
  return std::any_of(kept_.begin(), kept_.end(),
                     [&](const HistoryEvent& one) { return one.channel == channel && *one.sample.bytes == bytes; });
}

void History::take(std::uint32_t channel,
                   const dds::TopicInfo& topic,
                   const HubSample& sample,
                   const SampleFeatures& features) {
  const std::lock_guard lock(mutex_);
  if (!isEvent(channel, topic, sample, features))
    return;
  ++taken_;
  kept_.push_back({channel, sample});
  for (bytes_ += sample.bytes->size(); kept_.size() > kMost || bytes_ > kBytes; kept_.pop_front())
    bytes_ -= kept_.front().sample.bytes->size();
  changed_.notify_all();
}

std::vector<HistoryEvent> History::events() const {
  std::uint64_t none = 0;
  return eventsAfter(none);
}

std::vector<HistoryEvent> History::eventsAfter(std::uint64_t& known) const {
  const std::lock_guard lock(mutex_);
  const std::uint64_t more = std::min<std::uint64_t>(kept_.size(), taken_ - std::exchange(known, taken_));
  return {kept_.end() - static_cast<std::ptrdiff_t>(more), kept_.end()};
}

void History::wait(const std::stop_token& end, std::uint64_t known) const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, end, [&] { return taken_ != known; });
}

std::uint64_t History::taken() const {
  const std::lock_guard lock(mutex_);
  return taken_;
}

std::string History::packed(std::uint64_t now) const {
  std::string answer = beginSamples(now);
  const std::lock_guard lock(mutex_);
  for (const HistoryEvent& kept : kept_)
    appendSample(answer, kept.channel, kept.sample.time, *kept.sample.bytes);
  return answer;
}

}  // namespace tandem::console
