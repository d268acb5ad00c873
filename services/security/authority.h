// SPDX-License-Identifier: Apache-2.0
/** @file Certificate authority of a robot: issues and revokes certificates, signs permissions.
 *
 * A credentials folder contains ca.pem, governance.p7s, crl.pem and one folder per role (dds::credentialsOf()), and ca/
 * with the private key of the authority and all issued certificates. ca/ stays on the machine that created it, the
 * other files are copied to the machines that need them. Keys are readable only by their owner.
 */
#pragma once

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/dds/roles.h"

namespace tandem::security {

/** A file cannot be created or read; what() names it and the reason. */
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/** Start and duration of a certificate's validity. */
struct Validity {
  /// One day ago, because clocks of other machines may be behind.
  std::chrono::system_clock::time_point from = std::chrono::system_clock::now() - std::chrono::hours(24);
  int days = 365;
};

/** Rights and subject of a certificate. */
struct Grant {
  dds::Role role = dds::Role::kConsoleViewer;
  std::string name;                   ///< of the process or person: letters, digits, dots, hyphens, underscores
  std::vector<std::string> prefixes;  ///< topic prefixes, the robots' names
  std::vector<int> domains;           ///< DDS domains
  Validity validity;
};

/// Creates a folder with an authority, the governance and an empty revocation list.
/// @param organisation  part of every subject: letters, digits, dots, hyphens, underscores
/// @throw Error if the folder has one already or cannot be written.
void init(const std::filesystem::path& folder, const std::string& organisation, const Validity& validity);

/// Issues a certificate: writes TO/ROLE, and copies of ca.pem, governance.p7s and crl.pem to TO unless it is the
/// authority's folder. Replaces previous files of the role.
/// @throw Error without an authority, or for an invalid name.
void issue(const std::filesystem::path& folder, const Grant& grant, const std::filesystem::path& to);

/// Revokes all certificates of this name: rewrites crl.pem, which has to be copied to all machines.
/// @return number of newly revoked ones. @throw Error if none was ever issued.
int revoke(const std::filesystem::path& folder, const std::string& name);

/// The governance document, which defines the protection of domains and topics.
std::string governance();

/// The permissions of a certificate with this subject (RFC 2253).
std::string permissions(const Grant& grant, const std::string& subject);

}  // namespace tandem::security
