// SPDX-License-Identifier: Apache-2.0
/** @file tandem security: the credentials with which processes authenticate one another. */
#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/config.h"
#include "services/cli/subcommand.h"
#include "services/runtime/process.h"
#include "services/security/authority.h"
#include "services/security/verify.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;

struct SecurityCommand {
  std::string folder, name, to, from, deployment = runtime::defaultDeployment();
  std::vector<std::string> roles, folders, prefixes;
  std::vector<int> domains;
  int days = 0;
  bool json = false;
};

std::string roleNames() {
  std::string names;
  for (dds::Role role : dds::kRoles)
    names += (names.empty() ? "" : ", ") + std::string(dds::name(role));
  return names;
}

std::vector<dds::Role> rolesOf(const std::vector<std::string>& words) {
  if (words.empty())
    return {dds::kRoles.begin(), dds::kRoles.end()};
  std::vector<dds::Role> roles;
  for (const std::string& word : words) {
    const auto role = dds::roleFromName(word);
    if (!role)
      throw Failure(kUsage, "role: found '" + word + "', expected one of: " + roleNames());
    roles.push_back(*role);
  }
  return roles;
}

security::Validity validityOf(const SecurityCommand& options) {
  security::Validity validity;
  validity.days = options.days;
  if (options.from.empty())
    return validity;
  std::tm parts{};
  std::istringstream text(options.from);
  text >> std::get_time(&parts, "%Y-%m-%d");
  if (text.fail() || text.peek() != std::istringstream::traits_type::eof())
    throw Failure(kUsage, "--from: found '" + options.from + "', expected a day as 2026-12-31");
  validity.from = std::chrono::system_clock::from_time_t(timegm(&parts));
  return validity;
}

/// Runs a command of the certificate authority; its errors are usage errors.
int withAuthority(const std::function<void()>& command) {
  try {
    command();
  } catch (const security::Error& error) {
    throw Failure(kUsage, error.what());
  }
  return kOk;
}

int runInit(const SecurityCommand& options) {
  return withAuthority([&] {
    security::init(options.folder, options.name, validityOf(options));
    answer(options.folder + ": authority '" + options.name + "' created; keep " + options.folder +
               "/ca secret, and certify processes with `tandem security issue " + options.folder + "`",
           {{"folder", options.folder}, {"name", options.name}});
  });
}

int runIssue(const SecurityCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  security::Grant grant;
  grant.prefixes = options.prefixes.empty() ? std::vector{deployment.prefix} : options.prefixes;
  grant.domains = options.domains.empty() ? std::vector{deployment.domain} : options.domains;
  grant.name = options.name;
  grant.validity = validityOf(options);
  const std::vector<dds::Role> roles = rolesOf(options.roles);
  if (!options.name.empty() && roles.size() != 1)
    throw Failure(kUsage, "--name: found " + std::to_string(roles.size()) + " roles, expected one");
  const fs::path to = options.to.empty() ? options.folder : options.to;
  return withAuthority([&] {
    std::string text;
    nlohmann::ordered_json issued = nlohmann::ordered_json::array();
    for (dds::Role role : roles) {
      grant.role = role;
      security::issue(options.folder, grant, to);
      const std::string folder = (to / dds::name(role)).string();
      text += (text.empty() ? "" : "\n") + folder + ": for " + std::string(dds::describe(role));
      issued.push_back({{"role", dds::name(role)}, {"folder", folder}});
    }
    answer(text, issued);
  });
}

int runRevoke(const SecurityCommand& options) {
  return withAuthority([&] {
    const int count = security::revoke(options.folder, options.name);
    answer(options.folder + "/crl.pem: " + std::to_string(count) + " certificates of '" + options.name +
               "' newly revoked; copy it to all machines and restart their processes",
           {{"file", options.folder + "/crl.pem"}, {"name", options.name}, {"revoked", count}});
  });
}

int runVerify(const SecurityCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  security::VerificationTarget target;
  target.prefix = deployment.prefix;
  target.domain = deployment.domain;
  std::vector<std::string> folders = options.folders;
  if (folders.empty() && !deployment.security.empty())
    folders.push_back(deployment.security.string());
  if (folders.empty())
    throw Failure(kUsage, deployment.file.string() + ": key `security` is missing; give the folder to check");
  std::vector<security::Finding> findings;
  const auto take = [&findings](std::vector<security::Finding> more) {
    findings.insert(findings.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  for (const std::string& folder : folders) {
    take(security::checkCommon(folder, target));
    const std::vector<dds::Role> roles = options.roles.empty() ? security::rolesIn(folder) : rolesOf(options.roles);
    if (roles.empty())
      take({{security::Finding::Level::kBad, folder + ": found no credentials, expected a folder for each role"}});
    for (dds::Role role : roles)
      take(security::checkRole(folder, role, target));
    try {
      if (security::fingerprint(folder) != security::fingerprint(folders.front()))
        take({{security::Finding::Level::kBad, folder + ": another authority or governance than " + folders.front() +
                                                   ": their processes cannot connect"}});
    } catch (const security::Error&) {
      // Already reported, with its file.
    }
  }
  constexpr const char* kLevels[] = {"good", "warning", "bad"};
  auto worst = security::Finding::Level::kGood;
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const security::Finding& finding : findings) {
    worst = std::max(worst, finding.level);
    const char* level = kLevels[static_cast<int>(finding.level)];
    json.push_back({{"level", level}, {"found", finding.text}});
    if (!options.json)
      std::cout << fmt::format("{:<8} {}\n", level, finding.text);
  }
  if (options.json)
    std::cout << json.dump(2) << '\n';
  return worst == security::Finding::Level::kBad ? kFailure : kOk;
}

CLI::App* addCredentialOptions(CLI::App& parent,
                               int& exit_code,
                               const std::string& name,
                               const std::string& text,
                               const std::shared_ptr<SecurityCommand>& options,
                               int (*run)(const SecurityCommand&)) {
  CLI::App* command = parent.add_subcommand(name, text);
  command->callback([=, &exit_code] { guarded(exit_code, [&] { return run(*options); }); });
  return command;
}

void addValidity(CLI::App* command, const std::shared_ptr<SecurityCommand>& options, int days) {
  options->days = days;
  command->add_option("--days", options->days, "validity, days")->capture_default_str();
  command->add_option("--from", options->from, "first day of validity, e.g. 2026-12-31 (default: yesterday)");
}

}  // namespace

void registerSecurity(CLI::App& app, int& exit_code) {
  CLI::App* all =
      app.add_subcommand("security", "create, issue, revoke and verify DDS Security credentials (docs/security.md)");
  all->require_subcommand(1);

  auto making = std::make_shared<SecurityCommand>();
  making->name = "tandem";
  CLI::App* init =
      addCredentialOptions(*all, exit_code, "init", "create a certificate authority in a folder", making, runInit);
  init->add_option("folder", making->folder, "folder of credentials; it is created")->required();
  init->add_option("--name", making->name, "organisation name in all certificates")->capture_default_str();
  addValidity(init, making, 3650);

  auto issuing = std::make_shared<SecurityCommand>();
  CLI::App* issue = addCredentialOptions(*all, exit_code, "issue",
                                         "issue keys, certificates and permissions to processes", issuing, runIssue);
  issue->add_option("folder", issuing->folder, "the authority's folder")->required();
  issue->add_option("roles", issuing->roles, roleNames() + " (default: all)");
  issue->add_option("--name", issuing->name,
                    "name of the process or person, e.g. anna; only with one role (default: the role)");
  issue->add_option("--to", issuing->to, "folder to write to, for another machine (default: the authority's)");
  issue->add_option("-d,--deployment", issuing->deployment, "deployment that gives topic prefix and DDS domain")
      ->capture_default_str();
  issue->add_option("--prefix", issuing->prefixes, "topic prefixes instead of the deployment's (several robots)");
  issue->add_option("--domain", issuing->domains, "DDS domains instead of the deployment's")->check(CLI::Range(0, 232));
  addValidity(issue, issuing, 365);

  auto revoking = std::make_shared<SecurityCommand>();
  CLI::App* revoke =
      addCredentialOptions(*all, exit_code, "revoke", "revoke the certificates issued to a name", revoking, runRevoke);
  revoke->add_option("folder", revoking->folder, "the authority's folder")->required();
  revoke->add_option("name", revoking->name, "name given to `issue` (default name: the role)")->required();

  auto verifying = std::make_shared<SecurityCommand>();
  CLI::App* verify = addCredentialOptions(*all, exit_code, "verify",
                                          "verify credentials and report the reason of each error (DDS reports none)",
                                          verifying, runVerify);
  verify->add_option("folders", verifying->folders,
                     "folders of credentials; several must match one another (default: the deployment's)");
  verify->add_option("--role", verifying->roles, "roles to verify (default: all that are present)");
  verify->add_option("-d,--deployment", verifying->deployment, "deployment that gives topic prefix and DDS domain")
      ->capture_default_str();
  verify->add_flag("--json", verifying->json, "JSON instead of text");
  verify->footer("Exit code 1: a check failed.");
}

}  // namespace tandem::cli
