// SPDX-License-Identifier: Apache-2.0
/** @file Paths of the DDS Security files in a folder of credentials, which services/security makes and verifies. */
#pragma once

#include <filesystem>

#include "services/dds/roles.h"

namespace tandem::dds {

/** What one process needs; absolute paths. */
struct Credentials {
  std::filesystem::path ca;           ///< certificate of the authority, PEM
  std::filesystem::path governance;   ///< what is protected and how, signed
  std::filesystem::path crl;          ///< revoked certificates, PEM
  std::filesystem::path certificate;  ///< of the process, PEM
  std::filesystem::path key;          ///< its private key, PEM
  std::filesystem::path permissions;  ///< what it may write and read, signed
};

/// FOLDER/ca.pem, governance.p7s, crl.pem, and ROLE/certificate.pem, key.pem, permissions.p7s.
Credentials credentialsOf(const std::filesystem::path& folder, Role role);

}  // namespace tandem::dds
