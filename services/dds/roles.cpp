// SPDX-License-Identifier: Apache-2.0
#include "services/dds/roles.h"

#include <algorithm>

namespace tandem::dds {
namespace {

using enum Role;

constexpr unsigned bit(Role role) { return 1U << static_cast<unsigned>(role); }

template <class... R>
constexpr unsigned bits(R... roles) {
  return (bit(roles) | ...);
}

/** Roles of a value of Topic::publisher. */
struct Publisher {
  std::string_view words;
  unsigned roles;
};

constexpr unsigned kServices = bits(kPlanning, kControl, kHal, kTracker, kRecorder, kConsole);
constexpr unsigned kEveryone = kServices | bits(kConsoleOperator, kConsoleViewer);
constexpr std::string_view kClients = "clients";

constexpr std::array kPublishers{
    Publisher{"planning", bits(kPlanning)}, Publisher{"control", bits(kControl)},
    Publisher{"hal", bits(kHal)},           Publisher{"sim", bits(kHal)},
    Publisher{"hal or sim", bits(kHal)},    Publisher{"a tip tracker or sim", bits(kTracker, kHal)},
    Publisher{"recorder", bits(kRecorder)}, Publisher{kClients, bits(kConsoleOperator, kConsole)},
    Publisher{"every service", kServices},  Publisher{"everyone", kEveryone},
    Publisher{"console", bits(kConsole)},
};

/// The roles of a value of Topic::publisher; 0 if unknown.
constexpr unsigned rolesOf(std::string_view words) {
  for (const Publisher& publisher : kPublishers) {
    if (publisher.words == words)
      return publisher.roles;
  }
  return 0;
}

#define TANDEM_TOPIC(CONSTANT, ...) \
  static_assert(rolesOf(CONSTANT.publisher) != 0, "the publisher of a topic is not in the table of publishers");
#include "services/dds/topic_table.inc"
#undef TANDEM_TOPIC

constexpr const char* kAnyArm = "*";

}  // namespace

const char* name(Role role) {
  switch (role) {
    case kPlanning:
      return "planning";
    case kControl:
      return "control";
    case kHal:
      return "hal";
    case kTracker:
      return "tracker";
    case kConsoleOperator:
      return "console-operator";
    case kConsoleViewer:
      return "console-viewer";
    case kRecorder:
      return "recorder";
    case kConsole:
      return "console";
  }
  return "unknown";
}

const char* describe(Role role) {
  switch (role) {
    case kPlanning:
      return "tandem-planning";
    case kControl:
      return "tandem-control";
    case kHal:
      return "tandem-hal or tandem-sim";
    case kTracker:
      return "the driver of a tip tracker";
    case kConsoleOperator:
      return "clients that command";
    case kConsoleViewer:
      return "clients that only observe";
    case kRecorder:
      return "the recorder";
    case kConsole:
      return "tandem-console";
  }
  return "unknown";
}

std::optional<Role> roleFromName(std::string_view text) {
  for (Role role : kRoles) {
    if (text == name(role))
      return role;
  }
  return std::nullopt;
}

bool mayPublish(Role role, const TopicInfo& topic) { return (rolesOf(topic.publisher) & bit(role)) != 0; }

bool maySubscribe(Role role, const TopicInfo& topic) {
  unsigned readers = kEveryone;
  if (topic.profile == Profile::kCommand)
    readers = bits(kHal, kRecorder, kConsole);
  if (topic.publisher == kClients)
    readers = bits(kPlanning, kControl, kHal, kRecorder, kConsole);
  return (readers & bit(role)) != 0;
}

Rights rightsOf(Role role, const std::string& prefix) {
  Rights rights;
  for (const TopicInfo& topic : allTopics({kAnyArm})) {
    // topic.name already contains the arm.
    const std::string dds_name = ddsTopicName(prefix, topic.name);
    if (mayPublish(role, topic))
      rights.publish.push_back(dds_name);
    if (maySubscribe(role, topic))
      rights.subscribe.push_back(dds_name);
  }
  return rights;
}

}  // namespace tandem::dds
