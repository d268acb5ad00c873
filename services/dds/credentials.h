// SPDX-License-Identifier: Apache-2.0
/** @file Paths of the DDS Security files in a credentials folder, which services/security creates and verifies. */
#pragma once

#include <filesystem>

#include "services/dds/roles.h"

namespace tandem::dds {

/** Credential files of one process; absolute paths. */
struct Credentials {
  std::filesystem::path ca;           ///< certificate of the authority, PEM
  std::filesystem::path governance;   ///< protection of domain and topics, signed
  std::filesystem::path crl;          ///< revoked certificates, PEM
  std::filesystem::path certificate;  ///< of the process, PEM
  std::filesystem::path key;          ///< its private key, PEM
  std::filesystem::path permissions;  ///< its rights to write and read, signed
};

/// FOLDER/ca.pem, governance.p7s, crl.pem, and ROLE/certificate.pem, key.pem, permissions.p7s.
Credentials credentialsOf(const std::filesystem::path& folder, Role role);

}  // namespace tandem::dds
