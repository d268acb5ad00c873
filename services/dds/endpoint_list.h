// SPDX-License-Identifier: Apache-2.0
/** @file Private: writers and readers that discovery reports. */
#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "services/dds/endpoints.h"

namespace tandem::dds::detail {

/** Any thread. */
class EndpointList {
 public:
  using Guid = eprosima::fastrtps::rtps::GUID_t;
  using Participant = eprosima::fastrtps::rtps::GuidPrefix_t;

  /// @param topic  its name in DDS
  void note(const Guid& guid, const std::string& topic, bool writes, bool removed) {
    const std::lock_guard lock(mutex_);
    if (removed)
      endpoints_.erase(guid);
    else
      endpoints_[guid] = {topic.starts_with("rt/") ? topic.substr(2) : topic, {}, writes};
  }
  void forget(const Participant& participant) {
    const std::lock_guard lock(mutex_);
    std::erase_if(endpoints_, [&](const auto& end) { return end.first.guidPrefix == participant; });
  }
  /// Endpoints of the participants with these names. Discovery also reports those of this process.
  std::vector<Endpoint> all(const std::map<Participant, std::string>& names) const {
    std::vector<Endpoint> found;
    const std::lock_guard lock(mutex_);
    for (const auto& [guid, end] : endpoints_) {
      if (const auto name = names.find(guid.guidPrefix); name != names.end())
        found.push_back({end.topic, name->second, end.writes});
    }
    return found;
  }

 private:
  mutable std::mutex mutex_;
  std::map<Guid, Endpoint> endpoints_;
};

}  // namespace tandem::dds::detail
