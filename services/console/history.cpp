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
  const auto line = lines_.find(channel);
  return line != lines_.end() && std::any_of(line->second.kept.begin(), line->second.kept.end(),
                                             [&](const HistoryEvent& one) { return *one.sample.bytes == bytes; });
}

void History::makeRoom() {
  while (count_ > kMost || bytes_ > kBytes) {
    const auto less = [few = count_ > kMost](const auto& one, const auto& other) {
      return few ? one.second.kept.size() < other.second.kept.size() : one.second.bytes < other.second.bytes;
    };
    Line& largest = std::max_element(lines_.begin(), lines_.end(), less)->second;
    const std::size_t size = largest.kept.front().sample.bytes->size();
    largest.kept.pop_front();
    largest.bytes -= size;
    bytes_ -= size;
    --count_;
  }
}

void History::take(std::uint32_t channel,
                   const dds::TopicInfo& topic,
                   const HubSample& sample,
                   const SampleFeatures& features) {
  const std::lock_guard lock(mutex_);
  if (!isEvent(channel, topic, sample, features))
    return;
  Line& line = lines_[channel];
  line.kept.push_back({++taken_, channel, sample});
  line.bytes += sample.bytes->size();
  bytes_ += sample.bytes->size();
  ++count_;
  makeRoom();
  changed_.notify_all();
}

std::vector<HistoryEvent> History::after(std::uint64_t number) const {
  std::vector<HistoryEvent> events;
  for (const auto& [channel, line] : lines_) {
    const auto first = std::upper_bound(line.kept.begin(), line.kept.end(), number,
                                        [](std::uint64_t n, const HistoryEvent& one) { return n < one.number; });
    events.insert(events.end(), first, line.kept.end());
  }
  std::sort(events.begin(), events.end(),
            [](const HistoryEvent& one, const HistoryEvent& other) { return one.number < other.number; });
  return events;
}

std::vector<HistoryEvent> History::events() const {
  const std::lock_guard lock(mutex_);
  return after(0);
}

std::vector<HistoryEvent> History::eventsAfter(std::uint64_t& known) const {
  const std::lock_guard lock(mutex_);
  return after(std::exchange(known, taken_));
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
  for (const HistoryEvent& kept : events())
    appendSample(answer, kept.channel, kept.sample.time, *kept.sample.bytes);
  return answer;
}

}  // namespace tandem::console
