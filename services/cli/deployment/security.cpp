// SPDX-License-Identifier: Apache-2.0
/** @file tandem security: the credentials with which processes authenticate one another. */
#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/config.h"
#include "services/client/arguments.h"
#include "services/runtime/process.h"
#include "services/security/authority.h"
#include "services/security/verify.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;

struct SecurityCommand {
  std::string folder, name, to, from, deployment = service::defaultDeployment();
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

/// Runs a command of the authority; what it refuses is a wrong command line.
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
    std::cout << options.folder << ": authority '" << options.name << "' made; keep " << options.folder
              << "/ca to yourself, and certify processes with `tandem security issue " << options.folder << "`\n";
  });
}

int runIssue(const SecurityCommand& options) {
  const config::Deployment deployment = service::loadDeployment(options.deployment);
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
    for (dds::Role role : roles) {
      grant.role = role;
      security::issue(options.folder, grant, to);
      std::cout << (to / dds::name(role)).string() << ": for " << dds::describe(role) << '\n';
    }
  });
}

int runRevoke(const SecurityCommand& options) {
  return withAuthority([&] {
    const int count = security::revoke(options.folder, options.name);
    std::cout << options.folder << "/crl.pem: " << count << " certificates of '" << options.name
              << "' newly revoked; copy it to all machines and restart their processes\n";
  });
}

int runVerify(const SecurityCommand& options) {
  const config::Deployment deployment = service::loadDeployment(options.deployment);
  security::Purpose purpose;
  purpose.prefix = deployment.prefix;
  purpose.domain = deployment.domain;
  std::vector<std::string> folders = options.folders;
  if (folders.empty() && !deployment.security.empty())
    folders.push_back(deployment.security.string());
  if (folders.empty())
    throw Failure(kUsage, deployment.file.string() + ": has no `security`: name the folder to look at");
  std::vector<security::Finding> findings;
  const auto take = [&findings](std::vector<security::Finding> more) {
    findings.insert(findings.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  for (const std::string& folder : folders) {
    take(security::checkCommon(folder, purpose));
    const std::vector<dds::Role> roles = options.roles.empty() ? security::rolesIn(folder) : rolesOf(options.roles);
    if (roles.empty())
      take({{security::Finding::Level::kBad, folder + ": found no credentials, expected a folder for each role"}});
    for (dds::Role role : roles)
      take(security::checkRole(folder, role, purpose));
    try {
      if (security::fingerprint(folder) != security::fingerprint(folders.front()))
        take({{security::Finding::Level::kBad,
               folder + ": another authority or governance than " + folders.front() + ": their processes never meet"}});
    } catch (const security::Error&) {
      // Reported above, with its file.
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
  command->add_option("--days", options->days, "how long it is good")->capture_default_str();
  command->add_option("--from", options->from, "from this day on, e.g. 2026-12-31 (default: yesterday)");
}

}  // namespace

void registerSecurity(CLI::App& app, int& exit_code) {
  CLI::App* all = app.add_subcommand("security", "credentials: who may take part, and say what (docs/security.md)");
  all->require_subcommand(1);

  auto making = std::make_shared<SecurityCommand>();
  making->name = "tandem";
  CLI::App* init = addCredentialOptions(*all, exit_code, "init", "make an authority in a folder", making, runInit);
  init->add_option("folder", making->folder, "folder of credentials; is created")->required();
  init->add_option("--name", making->name, "the organisation in all certificates")->capture_default_str();
  addValidity(init, making, 3650);

  auto issuing = std::make_shared<SecurityCommand>();
  CLI::App* issue = addCredentialOptions(*all, exit_code, "issue", "certify processes: keys, certificates, permissions",
                                         issuing, runIssue);
  issue->add_option("folder", issuing->folder, "the authority's folder")->required();
  issue->add_option("roles", issuing->roles, roleNames() + " (default: all)");
  issue->add_option("--name", issuing->name, "of the process or person, e.g. anna; for one role (default: the role)");
  issue->add_option("--to", issuing->to, "folder to write to, for another machine (default: the authority's)");
  issue->add_option("-d,--deployment", issuing->deployment, "whose prefix and domain")->capture_default_str();
  issue->add_option("--prefix", issuing->prefixes, "topic prefixes in its place, of several robots");
  issue->add_option("--domain", issuing->domains, "DDS domains in its place")->check(CLI::Range(0, 232));
  addValidity(issue, issuing, 365);

  auto revoking = std::make_shared<SecurityCommand>();
  CLI::App* revoke =
      addCredentialOptions(*all, exit_code, "revoke", "take back what was issued to a name", revoking, runRevoke);
  revoke->add_option("folder", revoking->folder, "the authority's folder")->required();
  revoke->add_option("name", revoking->name, "as given to issue; a role where none was given")->required();

  auto verifying = std::make_shared<SecurityCommand>();
  CLI::App* verify = addCredentialOptions(
      *all, exit_code, "verify", "look at credentials before DDS does, which gives no reasons", verifying, runVerify);
  verify->add_option("folders", verifying->folders,
                     "folders of credentials; several must fit together (default: the deployment's)");
  verify->add_option("--role", verifying->roles, "only these roles (default: those that are there)");
  verify->add_option("-d,--deployment", verifying->deployment, "whose prefix and domain")->capture_default_str();
  verify->add_flag("--json", verifying->json, "JSON instead of text");
  verify->footer("Ends with 1 where something is bad.");
}

}  // namespace tandem::cli
