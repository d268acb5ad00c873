// SPDX-License-Identifier: Apache-2.0
#include "services/console/connection_graph.h"

#include <nlohmann/json.hpp>

namespace tandem::console {
namespace {

using Json = nlohmann::json;

/// Entries of `now` that differ from `before`.
Json changesOf(const ConnectionGraph::Ids& before, const ConnectionGraph::Ids& now, const char* ids) {
  Json changed = Json::array();
  for (const auto& [name, processes] : now) {
    const auto known = before.find(name);
    if (known == before.end() || known->second != processes)
      changed.push_back({{"name", name}, {ids, processes}});
  }
  // A topic that has lost its publishers alone stays: with an empty list.
  for (const auto& [name, processes] : before) {
    if (!now.contains(name))
      changed.push_back({{"name", name}, {ids, Json::array()}});
  }
  return changed;
}

bool contains(const ConnectionGraph& graph, const std::string& topic) {
  return graph.publishers.contains(topic) || graph.subscribers.contains(topic);
}

}  // namespace

std::string connectionGraphUpdate(const ConnectionGraph& before, const ConnectionGraph& now) {
  std::set<std::string> topics, services;
  for (const auto* side : {&before.publishers, &before.subscribers}) {
    for (const auto& [name, processes] : *side) {
      if (!contains(now, name))
        topics.insert(name);
    }
  }
  for (const auto& [name, processes] : before.providers) {
    if (!now.providers.contains(name))
      services.insert(name);
  }
  return Json{{"op", "connectionGraphUpdate"},
              {"publishedTopics", changesOf(before.publishers, now.publishers, "publisherIds")},
              {"subscribedTopics", changesOf(before.subscribers, now.subscribers, "subscriberIds")},
              {"advertisedServices", changesOf(before.providers, now.providers, "providerIds")},
              {"removedTopics", topics},
              {"removedServices", services}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace tandem::console
