// SPDX-License-Identifier: Apache-2.0
#include "services/dds/credentials.h"

namespace tandem::dds {

Credentials credentialsOf(const std::filesystem::path& folder, Role role) {
  const auto all = std::filesystem::absolute(folder).lexically_normal();
  const auto own = all / name(role);
  return {all / "ca.pem",          all / "governance.p7s", all / "crl.pem",
          own / "certificate.pem", own / "key.pem",        own / "permissions.p7s"};
}

}  // namespace tandem::dds
