// SPDX-License-Identifier: Apache-2.0
#include "services/security/verify.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>

#include "services/dds/credentials.h"
#include "services/security/openssl.h"

namespace tandem::security {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::system_clock;
using Level = Finding::Level;
constexpr int kSoon = 30;  // days

/** Collects findings; every check is one call. */
class Report {
 public:
  void add(Level level, const std::string& text) { findings_.push_back({level, text}); }
  /// Runs a check that throws on failure.
  template <class Check>
  bool check(Check check) {
    try {
      check();
      return true;
    } catch (const std::exception& error) {
      add(Level::kBad, error.what());
      return false;
    }
  }
  std::vector<Finding> take() { return std::move(findings_); }

 private:
  std::vector<Finding> findings_;
};

Clock::time_point timeOf(const ASN1_TIME* time) {
  std::tm parts{};
  good(ASN1_TIME_to_tm(time, &parts), "date");
  return Clock::from_time_t(timegm(&parts));
}

std::string day(Clock::time_point at) {
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(Clock::to_time_t(at)));
}

void checkDates(Report& report,
                const fs::path& file,
                Clock::time_point from,
                Clock::time_point until,
                Clock::time_point now,
                const char* remedy) {
  if (now < from)
    report.add(Level::kBad, fmt::format("{}: valid from {} on; the clock of this host shows {}: check it",
                                        file.string(), day(from), day(now)));
  else if (now >= until)
    report.add(Level::kBad, fmt::format("{}: expired {}; {}", file.string(), day(until), remedy));
  else if (until - now < std::chrono::hours(24) * kSoon)
    report.add(Level::kWarning, fmt::format("{}: expires {}; {}", file.string(), day(until), remedy));
  else
    report.add(Level::kGood, fmt::format("{}: valid until {}", file.string(), day(until)));
}

/// Checks file modes: only the owner may read keys, and only the owner may replace the other files.
void checkMode(Report& report, const fs::path& path, mode_t forbidden, const char* remedy) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0)
    return report.add(Level::kBad, path.string() + ": found nothing");
  if ((status.st_mode & forbidden) != 0)
    report.add(Level::kBad, fmt::format("{}: found mode {:04o}, open to others; {} {}", path.string(),
                                        status.st_mode & 07777U, remedy, path.string()));
}

/// @throw Error if the certificate was not issued by the authority, or was revoked.
void checkChain(const fs::path& file, X509* certificate, X509* authority, X509_CRL* crl) {
  const Key key(good(X509_get_pubkey(authority), "public key"));
  if (X509_NAME_cmp(X509_get_issuer_name(certificate), X509_get_subject_name(authority)) != 0 ||
      X509_verify(certificate, key.get()) != 1) {
    takeLastError();
    throw Error(file.string() +
                ": not issued by the authority in ca.pem; copy ca.pem and this file from the same folder of "
                "credentials, or run `tandem security issue` again");
  }
  X509_REVOKED* revoked = nullptr;
  if (crl != nullptr && X509_CRL_get0_by_cert(crl, &revoked, certificate) == 1)
    throw Error(file.string() + ": revoked; run `tandem security issue` again");
}

/// Text between <NAME> and </NAME>, searched from `begin`; moves `begin` behind it.
std::optional<std::string> element(const std::string& text, const std::string& name, std::size_t& begin) {
  const std::size_t open = text.find("<" + name + ">", begin);
  const std::size_t close = text.find("</" + name + ">", open);
  if (open == std::string::npos || close == std::string::npos)
    return std::nullopt;
  const std::size_t inside = open + name.size() + 2;
  begin = close + name.size() + 3;
  return text.substr(inside, close - inside);
}

std::optional<std::string> element(const std::string& text, const std::string& name) {
  std::size_t begin = 0;
  return element(text, name, begin);
}

std::vector<std::string> elements(const std::string& text, const std::string& name) {
  std::vector<std::string> all;
  std::size_t begin = 0;
  while (auto one = element(text, name, begin))
    all.push_back(*one);
  return all;
}

/// @throw Error for missing permissions, and for permissions that exceed the role.
void checkTopics(const fs::path& file,
                 const std::string& document,
                 const char* kind,
                 const std::vector<std::string>& wanted,
                 const std::string& prefix) {
  const std::vector<std::string> found = elements(element(document, kind).value_or(""), "topic");
  const std::string robot = dds::ddsTopicName(prefix, "");
  for (const std::string& topic : wanted) {
    if (std::find(found.begin(), found.end(), topic) == found.end())
      throw Error(
          fmt::format("{}: no permission to {} {}: issued for another robot or by another version; "
                      "run `tandem security issue` again",
                      file.string(), kind, topic));
  }
  for (const std::string& topic : found) {
    if (topic.starts_with(robot) && std::find(wanted.begin(), wanted.end(), topic) == wanted.end())
      throw Error(
          fmt::format("{}: permission to {} {} exceeds this role: issued for another role or by another version; "
                      "run `tandem security issue` again",
                      file.string(), kind, topic));
  }
}

/// @throw Error for permissions of another subject, robot, domain or role.
void checkPermissions(const fs::path& file,
                      const std::string& document,
                      X509* certificate,
                      dds::Role role,
                      const VerificationTarget& target) {
  const std::string subject = subjectOf(certificate), named = element(document, "subject_name").value_or("");
  if (named != subject)
    throw Error(fmt::format("{}: subject_name: found '{}', expected '{}', as the certificate has it, in this order",
                            file.string(), named, subject));
  const std::vector<std::string> domains = elements(document, "id");
  if (std::find(domains.begin(), domains.end(), std::to_string(target.domain)) == domains.end())
    throw Error(fmt::format("{}: not for domain {}; run `tandem security issue` again for this deployment",
                            file.string(), target.domain));
  const dds::Rights rights = dds::rightsOf(role, target.prefix);
  checkTopics(file, document, "publish", rights.publish, target.prefix);
  checkTopics(file, document, "subscribe", rights.subscribe, target.prefix);
}

void checkAuthority(Report& report,
                    const fs::path& folder,
                    const dds::Credentials& files,
                    const VerificationTarget& target) {
  const Certificate authority = readCertificate(files.ca);
  report.check([&] { checkChain(files.ca, authority.get(), authority.get(), nullptr); });
  checkDates(report, files.ca, timeOf(X509_get0_notBefore(authority.get())),
             timeOf(X509_get0_notAfter(authority.get())), target.now,
             "create a new authority and issue all credentials again");
  report.check([&] {
    if (verified(files.governance, authority.get()) != governance())
      throw Error(
          files.governance.string() +
          ": found the governance of another release; processes with different governance cannot connect: create "
          "an authority with `tandem security init` in a new folder and issue all credentials again");
    report.add(Level::kGood,
               "governance and authority: " + fingerprint(folder).substr(0, 16) + ", must be the same on all machines");
  });
  report.check([&] {
    const Crl crl = readCrl(files.crl);
    const Key key(good(X509_get_pubkey(authority.get()), "public key"));
    if (X509_CRL_verify(crl.get(), key.get()) != 1) {
      takeLastError();
      throw Error(files.crl.string() +
                  ": the list of revoked certificates is not signed by the authority in the same folder; copy "
                  "both files from the same authority");
    }
    checkDates(report, files.crl, timeOf(X509_CRL_get0_lastUpdate(crl.get())),
               timeOf(X509_CRL_get0_nextUpdate(crl.get())), target.now, "`tandem security revoke` writes it again");
  });
}

}  // namespace

std::vector<Finding> checkCommon(const fs::path& folder, const VerificationTarget& target) {
  Report report;
  const dds::Credentials files = dds::credentialsOf(folder, dds::Role::kControl);
  checkMode(report, folder, S_IWGRP | S_IWOTH, "chmod go-w");
  if (std::error_code ignored; fs::exists(folder / "ca", ignored)) {
    checkMode(report, folder / "ca", S_IRWXG | S_IRWXO, "chmod 0700");
    checkMode(report, folder / "ca" / "key.pem", S_IRWXG | S_IRWXO, "chmod 0600");
  }
  report.check([&] { checkAuthority(report, folder, files, target); });
  return report.take();
}

std::vector<Finding> checkRole(const fs::path& folder, dds::Role role, const VerificationTarget& target) {
  Report report;
  const dds::Credentials files = dds::credentialsOf(folder, role);
  checkMode(report, files.key.parent_path(), S_IRWXG | S_IRWXO, "chmod 0700");
  checkMode(report, files.key, S_IRWXG | S_IRWXO, "chmod 0600");
  report.check([&] {
    const Certificate authority = readCertificate(files.ca), certificate = readCertificate(files.certificate);
    const Crl crl = readCrl(files.crl);
    report.check([&] { checkChain(files.certificate, certificate.get(), authority.get(), crl.get()); });
    checkDates(report, files.certificate, timeOf(X509_get0_notBefore(certificate.get())),
               timeOf(X509_get0_notAfter(certificate.get())), target.now, "run `tandem security issue` again");
    report.check([&] {
      if (X509_check_private_key(certificate.get(), readKey(files.key).get()) != 1) {
        takeLastError();
        throw Error(files.key.string() +
                    ": not the key of the certificate in the same folder; copy both from the same `tandem security "
                    "issue`, or issue again");
      }
    });
    report.check([&] {
      checkPermissions(files.permissions, verified(files.permissions, authority.get()), certificate.get(), role,
                       target);
      report.add(Level::kGood, fmt::format("{}: {} at robot {}, domain {}", files.permissions.string(),
                                           subjectOf(certificate.get()), target.prefix, target.domain));
    });
  });
  return report.take();
}

std::vector<dds::Role> rolesIn(const fs::path& folder) {
  std::vector<dds::Role> roles;
  for (dds::Role role : dds::kRoles) {
    std::error_code ignored;
    if (fs::exists(dds::credentialsOf(folder, role).key.parent_path(), ignored))
      roles.push_back(role);
  }
  return roles;
}

std::string fingerprint(const fs::path& folder) {
  const dds::Credentials files = dds::credentialsOf(folder, dds::Role::kControl);
  const std::string text = readText(files.ca) + readText(files.governance);
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  good(EVP_Digest(text.data(), text.size(), digest, &size, EVP_sha256(), nullptr), "SHA-256");
  std::string hex;
  for (unsigned int i = 0; i < size; ++i)
    hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

std::string obstacle(const fs::path& folder, dds::Role role, const VerificationTarget& target) {
  std::vector<Finding> findings = checkCommon(folder, target);
  for (Finding& finding : checkRole(folder, role, target))
    findings.push_back(std::move(finding));
  const auto bad = std::find_if(findings.begin(), findings.end(),
                                [](const Finding& finding) { return finding.level == Level::kBad; });
  return bad == findings.end() ? "" : bad->text;
}

}  // namespace tandem::security
