// SPDX-License-Identifier: Apache-2.0
/** @file Verification of credentials before DDS starts, with a reason for each refusal. */
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/dds/roles.h"

namespace tandem::security {

/** Result of one check. */
struct Finding {
  enum class Level { kGood, kWarning, kBad };
  Level level = Level::kGood;
  std::string text;  ///< names the file, the finding, and the remedy
};

/** Robot, domain and time for which the credentials are verified. */
struct VerificationTarget {
  std::string prefix = "tandem";
  int domain = 0;
  std::chrono::system_clock::time_point now = std::chrono::system_clock::now();
};

/// Checks the files common to all roles: authority, governance, revocation list. Never throws because of their content.
std::vector<Finding> checkCommon(const std::filesystem::path& folder, const VerificationTarget& target);

/// Checks the credentials of one role, which must exist.
std::vector<Finding> checkRole(const std::filesystem::path& folder, dds::Role role, const VerificationTarget& target);

/// Roles with a folder in `folder`.
std::vector<dds::Role> rolesIn(const std::filesystem::path& folder);

/// SHA-256 of authority and governance, which must be the same on all machines.
/// @throw Error if a file cannot be read.
std::string fingerprint(const std::filesystem::path& folder);

/// First finding that prevents a process of this role from connecting; empty if none.
std::string obstacle(const std::filesystem::path& folder, dds::Role role, const VerificationTarget& target);

}  // namespace tandem::security
