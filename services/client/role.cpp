// SPDX-License-Identifier: Apache-2.0
#include "services/client/role.h"

#include "services/runtime/process.h"
#include "services/security/verify.h"

namespace tandem::client {
namespace {

/// Value of --role, one per process.
std::string& wanted() {
  static std::string role;
  return role;
}

bool has(const config::Deployment& deployment, dds::Role role) {
  const auto roles = security::rolesIn(deployment.security);
  return std::find(roles.begin(), roles.end(), role) != roles.end();
}

}  // namespace

void addRoleOption(CLI::App& app) {
  app.add_option("--role", wanted(),
                 "security role: operator or viewer (default: operator; viewer if only viewer credentials exist)")
      ->envname("TANDEM_ROLE")
      ->check(CLI::IsMember({"operator", "viewer"}));
}

dds::Role localRole(const config::Deployment& deployment) {
  if (wanted() == "operator")
    return dds::Role::kConsoleOperator;
  if (wanted() == "viewer")
    return dds::Role::kConsoleViewer;
  const bool viewer = !deployment.security.empty() && !has(deployment, dds::Role::kConsoleOperator) &&
                      has(deployment, dds::Role::kConsoleViewer);
  return viewer ? dds::Role::kConsoleViewer : dds::Role::kConsoleOperator;
}

dds::BusOptions clientOptions(const config::Deployment& deployment) {
  return runtime::busOptions(deployment, "cli", localRole(deployment));
}

}  // namespace tandem::client
