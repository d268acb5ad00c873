// SPDX-License-Identifier: Apache-2.0
/** @file Connection graph: publishers and readers of topics, providers of services, and messages about changes. No
 * sockets here. */
#pragma once

#include <map>
#include <set>
#include <string>

namespace tandem::console {

/** Names of processes by topic or service. */
struct ConnectionGraph {
  using Ids = std::map<std::string, std::set<std::string>>;
  Ids publishers, subscribers, providers;
  bool operator==(const ConnectionGraph&) const = default;
};

/// A connectionGraphUpdate with what differs: topics and services that are new or have other processes, and those that
/// have none any more.
std::string connectionGraphUpdate(const ConnectionGraph& before, const ConnectionGraph& now);

}  // namespace tandem::console
