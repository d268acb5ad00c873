// SPDX-License-Identifier: Apache-2.0
/** @file Security roles of processes and their rights to write and read, derived from the table of topics.
 *
 * With security (docs/security.md), rightsOf() gives the permissions of each process, and all other processes
 * enforce them. */
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/dds/topics.h"

namespace tandem::dds {

/** Security role of a process. */
enum class Role {
  kPlanning,
  kControl,
  kHal,              ///< tandem-hal, and tandem-sim in its place
  kTracker,          ///< driver of a tip tracker
  kConsoleOperator,  ///< clients that command
  kConsoleViewer,    ///< clients that only observe
  kRecorder,
  kConsole,  ///< tandem-console: forwards requests of pages with a valid token, shows them all topics
};

inline constexpr std::array kRoles{Role::kPlanning,        Role::kControl,       Role::kHal,      Role::kTracker,
                                   Role::kConsoleOperator, Role::kConsoleViewer, Role::kRecorder, Role::kConsole};

/// "planning", "control", "hal", "tracker", "console-operator", "console-viewer", "recorder", "console".
const char* name(Role role);
std::optional<Role> roleFromName(std::string_view name);
/// For people, e.g. "tandem-hal or tandem-sim".
const char* describe(Role role);

/// Whether a role may write a topic, by its Topic::publisher. A topic whose publisher has no role does not compile.
bool mayPublish(Role role, const TopicInfo& topic);

/// Whether a role may read a topic: requests are for the services that reply, commands for the drive side, all others
/// for all roles. The recorder and tandem-console read everything.
bool maySubscribe(Role role, const TopicInfo& topic);

/** DDS names of the topics that a role may write and read; `*` matches the name of any arm. */
struct Rights {
  std::vector<std::string> publish, subscribe;
};

/// Rights of a role at the robot with this topic prefix.
/// @throw std::invalid_argument for an invalid prefix.
Rights rightsOf(Role role, const std::string& prefix);

}  // namespace tandem::dds
