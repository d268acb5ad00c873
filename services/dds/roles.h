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

/** What a process is there for. */
enum class Role {
  kPlanning,
  kControl,
  kHal,              ///< tandem-hal, and tandem-sim in its place
  kTracker,          ///< driver of a tip tracker
  kConsoleOperator,  ///< clients that command
  kConsoleViewer,    ///< clients that look
  kRecorder,
  kConsole,  ///< tandem-console: asks in the names of those who have shown it a token, shows them everything
};

inline constexpr std::array kRoles{Role::kPlanning,        Role::kControl,       Role::kHal,      Role::kTracker,
                                   Role::kConsoleOperator, Role::kConsoleViewer, Role::kRecorder, Role::kConsole};

/// "planning", "control", "hal", "tracker", "console-operator", "console-viewer", "recorder", "console".
const char* name(Role role);
std::optional<Role> roleFromName(std::string_view name);
/// For people, e.g. "tandem-hal or tandem-sim".
const char* describe(Role role);

/// Whether a role may write a topic, by what Topic::publisher says of it. A topic whose publisher stands for no role
/// does not compile.
bool mayPublish(Role role, const TopicInfo& topic);

/// Whether a role may read a topic: requests are for those who answer them, commands for who obeys them, the rest is
/// for all. A recorder and tandem-console read everything.
bool maySubscribe(Role role, const TopicInfo& topic);

/** Names in DDS of the topics that a role may write and read; `*` stands for the name of any arm. */
struct Rights {
  std::vector<std::string> publish, subscribe;
};

/// Rights of a role at the robot with this topic prefix.
/// @throw std::invalid_argument for a prefix that is none.
Rights rightsOf(Role role, const std::string& prefix);

}  // namespace tandem::dds
