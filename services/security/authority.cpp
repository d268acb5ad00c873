// SPDX-License-Identifier: Apache-2.0
#include "services/security/authority.h"

#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <system_error>

#include "services/dds/credentials.h"
#include "services/security/openssl.h"

namespace tandem::security {
namespace fs = std::filesystem;
namespace {

constexpr const char* kCurve = "P-256";  // ECDSA-SHA256 and ECDH, as supported by Fast DDS

/** File paths of an authority. */
struct Files {
  explicit Files(const fs::path& folder)
      : home(folder / "ca"), key(home / "key.pem"), certificate(folder / "ca.pem"), issued(home / "issued") {}
  fs::path home, key, certificate, issued;
};

void makeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw Error(folder.string() + ": cannot be created: " + error.message());
  if (chmod(folder.c_str(), 0700) != 0)
    throw Error(folder.string() + ": cannot be set to mode 0700");
}

void checkName(const std::string& what, const std::string& name) {
  const bool fits = !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_';
  });
  if (!fits)
    throw Error(what + ": found '" + name + "', expected 1 to 64 letters, digits, dots, hyphens and underscores");
}

void checkValidity(const Validity& validity) {
  constexpr int kMostDays = 36500;
  if (validity.days < 1 || validity.days > kMostDays)
    throw Error("days: found " + std::to_string(validity.days) + ", expected 1 to " + std::to_string(kMostDays));
}

/// 63 random bits, so that no counter is needed.
void setRandomSerial(ASN1_INTEGER* serial) {
  std::uint64_t number = 0;
  good(RAND_bytes(reinterpret_cast<unsigned char*>(&number), sizeof(number)), "random numbers");
  good(ASN1_INTEGER_set_uint64(serial, (number >> 1) | 1U), "serial number");
}

std::string serialOf(X509* certificate) {
  std::uint64_t number = 0;
  good(ASN1_INTEGER_get_uint64(&number, X509_get0_serialNumber(certificate)), "serial number");
  return std::to_string(number);
}

void addExtension(X509* certificate, X509* issuer, int kind, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = good(X509V3_EXT_conf_nid(nullptr, &context, kind, value), value);
  const int added = X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
  good(added, value);
}

/// A certificate without extensions and signature. Its subject has the given entries, in the order O, OU, CN.
Certificate draft(const std::vector<std::pair<const char*, std::string>>& subject,
                  EVP_PKEY* key,
                  const Validity& validity) {
  Certificate certificate(good(X509_new(), "certificate"));
  X509* x = certificate.get();
  good(X509_set_version(x, X509_VERSION_3), "version");
  setRandomSerial(X509_get_serialNumber(x));
  for (const auto& [kind, value] : subject) {
    const auto* text = reinterpret_cast<const unsigned char*>(value.c_str());
    good(X509_NAME_add_entry_by_txt(X509_get_subject_name(x), kind, MBSTRING_ASC, text, -1, -1, 0), value);
  }
  std::time_t from = std::chrono::system_clock::to_time_t(validity.from);
  good(X509_time_adj_ex(X509_getm_notBefore(x), 0, 0, &from), "date");
  good(X509_time_adj_ex(X509_getm_notAfter(x), validity.days, 0, &from), "date");
  good(X509_set_pubkey(x, key), "public key");
  return certificate;
}

void finish(X509* certificate, X509* issuer, EVP_PKEY* issuer_key, const char* constraints, const char* usage) {
  good(X509_set_issuer_name(certificate, X509_get_subject_name(issuer)), "issuer");
  addExtension(certificate, issuer, NID_basic_constraints, constraints);
  addExtension(certificate, issuer, NID_key_usage, usage);
  addExtension(certificate, issuer, NID_subject_key_identifier, "hash");
  addExtension(certificate, issuer, NID_authority_key_identifier, "keyid:always");
  good(X509_sign(certificate, issuer_key, EVP_sha256()), "signature");
}

/// Signs a revocation list. It is valid as long as the authority, because an expired list would stop the robot.
std::string signList(X509_CRL* crl,
                     X509* authority,
                     EVP_PKEY* key,
                     std::chrono::system_clock::time_point since = Validity().from) {
  ASN1_TIME* from = good(ASN1_TIME_set(nullptr, std::chrono::system_clock::to_time_t(since)), "date");
  const int set = X509_CRL_set1_lastUpdate(crl, from);
  ASN1_TIME_free(from);
  good(set, "date");
  good(X509_CRL_set1_nextUpdate(crl, X509_get0_notAfter(authority)), "date");
  good(X509_CRL_sort(crl), "list of revocations");
  good(X509_CRL_sign(crl, key, EVP_sha256()), "signature");
  return textOf(crl);
}

Crl emptyList(X509* authority) {
  Crl crl(good(X509_CRL_new(), "list of revocations"));
  good(X509_CRL_set_version(crl.get(), X509_CRL_VERSION_2), "version");
  good(X509_CRL_set_issuer_name(crl.get(), X509_get_subject_name(authority)), "issuer");
  return crl;
}

Files opened(const fs::path& folder) {
  Files files(folder);
  std::error_code ignored;
  if (!fs::exists(files.key, ignored))
    throw Error(folder.string() + ": found no authority (" + files.key.string() +
                "), expected the folder that `tandem security init` created");
  return files;
}

/// Copies the files that every machine needs; no effect in the authority's own folder.
void copyCommon(const fs::path& folder, const fs::path& to) {
  std::error_code ignored;
  if (fs::equivalent(folder, to, ignored))
    return;
  const dds::Credentials from = dds::credentialsOf(folder, dds::Role::kControl);
  const dds::Credentials there = dds::credentialsOf(to, dds::Role::kControl);
  writeFile(there.ca, readText(from.ca));
  writeFile(there.governance, readText(from.governance));
  writeFile(there.crl, readText(from.crl));
}

}  // namespace

void init(const fs::path& folder, const std::string& organisation, const Validity& validity) {
  checkName("name", organisation);
  checkValidity(validity);
  const Files files(folder);
  std::error_code ignored;
  if (fs::exists(files.home, ignored) || fs::exists(files.certificate, ignored))
    throw Error(
        folder.string() +
        ": found a certificate authority, expected none; `tandem security issue` uses it. A new authority in its "
        "place would make every issued certificate invalid; for one choose another folder");
  makeFolder(folder);
  makeFolder(files.home);
  makeFolder(files.issued);
  const Key key(good(EVP_EC_gen(kCurve), "key"));
  const Certificate authority = draft({{"O", organisation}, {"CN", organisation + " authority"}}, key.get(), validity);
  finish(authority.get(), authority.get(), key.get(), "critical,CA:TRUE,pathlen:0",
         "critical,digitalSignature,keyCertSign,cRLSign");
  const dds::Credentials common = dds::credentialsOf(folder, dds::Role::kControl);
  writeFile(files.key, textOf(key.get()), true);
  writeFile(files.certificate, textOf(authority.get()));
  writeFile(common.governance, sign(governance(), authority.get(), key.get()));
  const Crl crl = emptyList(authority.get());
  writeFile(common.crl, signList(crl.get(), authority.get(), key.get(), validity.from));
}

void issue(const fs::path& folder, const Grant& grant, const fs::path& to) {
  const std::string name = grant.name.empty() ? dds::name(grant.role) : grant.name;
  checkName("name", name);
  checkValidity(grant.validity);
  const Files files = opened(folder);
  const Certificate authority = readCertificate(files.certificate);
  const Key authority_key = readKey(files.key);
  char organisation[128] = "";
  X509_NAME_get_text_by_NID(X509_get_subject_name(authority.get()), NID_organizationName, organisation,
                            sizeof(organisation));

  const Key key(good(EVP_EC_gen(kCurve), "key"));
  const Certificate certificate =
      draft({{"O", organisation}, {"OU", dds::name(grant.role)}, {"CN", name}}, key.get(), grant.validity);
  finish(certificate.get(), authority.get(), authority_key.get(), "critical,CA:FALSE",
         "critical,digitalSignature,keyAgreement");
  const std::string document = permissions(grant, subjectOf(certificate.get()));

  const dds::Credentials own = dds::credentialsOf(to, grant.role);
  makeFolder(to);
  makeFolder(own.key.parent_path());
  copyCommon(folder, to);
  const std::string text = textOf(certificate.get());
  writeFile(files.issued / (serialOf(certificate.get()) + ".pem"), text);
  writeFile(own.key, textOf(key.get()), true);
  writeFile(own.certificate, text);
  writeFile(own.permissions, sign(document, authority.get(), authority_key.get()));
}

int revoke(const fs::path& folder, const std::string& name) {
  const Files files = opened(folder);
  const Certificate authority = readCertificate(files.certificate);
  const Key key = readKey(files.key);
  const fs::path list = dds::credentialsOf(folder, dds::Role::kControl).crl;
  const Crl crl = readCrl(list);
  int known = 0, fresh = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(files.issued)) {
    const Certificate certificate = readCertificate(entry.path());
    if (commonNameOf(certificate.get()) != name)
      continue;
    ++known;
    X509_REVOKED* entry_of_list = nullptr;
    if (X509_CRL_get0_by_cert(crl.get(), &entry_of_list, certificate.get()) > 0)
      continue;
    X509_REVOKED* revoked = good(X509_REVOKED_new(), "revocation");
    good(X509_REVOKED_set_serialNumber(revoked, X509_get_serialNumber(certificate.get())), "serial number");
    ASN1_TIME* now = good(ASN1_TIME_set(nullptr, std::time(nullptr)), "date");
    good(X509_REVOKED_set_revocationDate(revoked, now), "date");
    ASN1_TIME_free(now);
    good(X509_CRL_add0_revoked(crl.get(), revoked), "revocation");
    ++fresh;
  }
  if (known == 0)
    throw Error(folder.string() + ": found no certificate issued to '" + name + "'");
  if (fresh > 0)
    writeFile(list, signList(crl.get(), authority.get(), key.get()));
  return fresh;
}

}  // namespace tandem::security
