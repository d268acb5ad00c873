// SPDX-License-Identifier: Apache-2.0
#include "services/client/role.h"

#include "services/runtime/process.h"
#include "services/security/verify.h"

namespace tandem::cli {
namespace {

/// The one command line of this process.
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
                 "operator or viewer (default: operator, unless there are credentials of a viewer alone)")
      ->envname("TANDEM_ROLE")
      ->check(CLI::IsMember({"operator", "viewer"}));
}

dds::Role roleHere(const config::Deployment& deployment) {
  if (wanted() == "operator")
    return dds::Role::kConsoleOperator;
  if (wanted() == "viewer")
    return dds::Role::kConsoleViewer;
  const bool viewer = !deployment.security.empty() && !has(deployment, dds::Role::kConsoleOperator) &&
                      has(deployment, dds::Role::kConsoleViewer);
  return viewer ? dds::Role::kConsoleViewer : dds::Role::kConsoleOperator;
}

dds::BusOptions clientOptions(const config::Deployment& deployment) {
  return service::busOptions(deployment, "cli", roleHere(deployment));
}

}  // namespace tandem::cli
