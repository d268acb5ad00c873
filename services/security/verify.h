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

/** One thing that was looked at. */
struct Finding {
  enum class Level { kGood, kWarning, kBad };
  Level level = Level::kGood;
  std::string text;  ///< names the file, what was found, and what to do about it
};

/** What the credentials shall be good for. */
struct VerificationTarget {
  std::string prefix = "tandem";
  int domain = 0;
  std::chrono::system_clock::time_point now = std::chrono::system_clock::now();
};

/// What all roles share: authority, governance, revocations. Never throws for what is in the files.
std::vector<Finding> checkCommon(const std::filesystem::path& folder, const VerificationTarget& target);

/// The credentials of one role, which has to be there.
std::vector<Finding> checkRole(const std::filesystem::path& folder, dds::Role role, const VerificationTarget& target);

/// Roles that have a folder there.
std::vector<dds::Role> rolesIn(const std::filesystem::path& folder);

/// SHA-256 of authority and governance: has to be the same on all machines.
/// @throw Error where a file cannot be read.
std::string fingerprint(const std::filesystem::path& folder);

/// The first thing that keeps a process of this role from taking part; empty where nothing does.
std::string obstacle(const std::filesystem::path& folder, dds::Role role, const VerificationTarget& target);

}  // namespace tandem::security
