// SPDX-License-Identifier: Apache-2.0
/** @file Certificate authority of a robot: issues and revokes certificates, signs permissions.
 *
 * A folder of credentials holds ca.pem, governance.p7s, crl.pem and one folder per role (dds::credentialsOf()); beside
 * them ca/, the authority itself: its private key and what it has issued. ca/ stays where it was made, the rest is
 * copied to the machines that need it. Keys are readable by their owner alone.
 */
#pragma once

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/dds/roles.h"

namespace tandem::security {

/** Why something cannot be made or read; names the file. */
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/** From when on, and for how many days, a certificate is good. */
struct Validity {
  /// A day ago: clocks of other machines may be behind.
  std::chrono::system_clock::time_point from = std::chrono::system_clock::now() - std::chrono::hours(24);
  int days = 365;
};

/** What a process is certified for. */
struct Grant {
  dds::Role role = dds::Role::kConsoleViewer;
  std::string name;                   ///< of the process or person: letters, digits, dots, hyphens, underscores
  std::vector<std::string> prefixes;  ///< topic prefixes, the robots' names
  std::vector<int> domains;           ///< DDS domains
  Validity validity;
};

/// Makes an authority, the governance and an empty list of revocations in a folder, which is created.
/// @param organisation  stands in every subject: letters, digits, dots, hyphens, underscores
/// @throw Error where there is one already, or the folder cannot be written.
void init(const std::filesystem::path& folder, const std::string& organisation, const Validity& validity);

/// Certifies a process: writes TO/ROLE, and beside it copies of ca.pem, governance.p7s and crl.pem where TO is another
/// folder than the authority's. What the role had there is replaced.
/// @throw Error where there is no authority, or a name is refused.
void issue(const std::filesystem::path& folder, const Grant& grant, const std::filesystem::path& to);

/// Takes back every certificate of this name: crl.pem is written anew, and has to be copied to all machines.
/// @return how many are newly revoked. @throw Error where none has ever been issued.
int revoke(const std::filesystem::path& folder, const std::string& name);

/// The governance document: what DDS protects, and how.
std::string governance();

/// The permissions of a certificate with this subject (RFC 2253).
std::string permissions(const Grant& grant, const std::string& subject);

}  // namespace tandem::security
