// SPDX-License-Identifier: Apache-2.0
#include "services/security/openssl.h"

#include <fcntl.h>
#include <openssl/err.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

namespace tandem::security {
namespace {

constexpr int kSigning = PKCS7_DETACHED | PKCS7_TEXT;

Bio memory() { return Bio(good(BIO_new(BIO_s_mem()), "memory")); }

/// Contains a copy of the text.
Bio memory(const std::string& text) {
  Bio bio = memory();
  if (!text.empty())
    good(BIO_write(bio.get(), text.data(), static_cast<int>(text.size())), "memory");
  return bio;
}

std::string contents(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(std::max(size, 0L))};
}

/// @param read  one of OpenSSL's functions PEM_read_bio_...
template <class T>
T* readPem(const std::filesystem::path& file, const char* what, T* (*read)(BIO*, T**, pem_password_cb*, void*)) {
  const Bio bio = memory(readText(file));
  // Never prompts for a password: a service that starts automatically has no terminal.
  T* object = read(
      bio.get(), nullptr, [](char*, int, int, void*) { return -1; }, nullptr);
  return good(object, file.string() + ": found no " + what + " in PEM");
}

}  // namespace

std::string takeLastError() {
  const unsigned long code = ERR_peek_last_error();
  const char* reason = code != 0 ? ERR_reason_error_string(code) : nullptr;
  ERR_clear_error();
  return reason != nullptr ? reason : "unknown OpenSSL error";
}

std::string readText(const std::filesystem::path& file) {
  std::error_code ignored;
  std::ifstream stream(file, std::ios::binary);
  if (!std::filesystem::is_regular_file(file, ignored) || !stream)
    throw Error(file.string() + ": found no readable file");
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void writeFile(const std::filesystem::path& file, const std::string& text, bool secret) {
  const std::string draft = file.string() + ".new";
  unlink(draft.c_str());
  const int target = open(draft.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, secret ? 0600 : 0644);
  bool written = target >= 0 && fchmod(target, secret ? 0600 : 0644) == 0;
  for (std::size_t done = 0; written && done < text.size();) {
    const ssize_t count = write(target, text.data() + done, text.size() - done);
    written = count > 0;
    done += written ? static_cast<std::size_t>(count) : 0;
  }
  written = written && fsync(target) == 0;
  const int why = errno;
  if (target >= 0)
    close(target);
  if (!written || rename(draft.c_str(), file.c_str()) != 0)
    throw Error(file.string() + ": cannot be written: " + std::strerror(written ? errno : why));
}

Certificate readCertificate(const std::filesystem::path& file) {
  return Certificate(readPem(file, "certificate", PEM_read_bio_X509));
}
Key readKey(const std::filesystem::path& file) {
  return Key(readPem(file, "private key (without password)", PEM_read_bio_PrivateKey));
}
Crl readCrl(const std::filesystem::path& file) {
  return Crl(readPem(file, "list of revocations", PEM_read_bio_X509_CRL));
}

std::string textOf(X509* certificate) {
  const Bio bio = memory();
  good(PEM_write_bio_X509(bio.get(), certificate), "certificate");
  return contents(bio.get());
}
std::string textOf(EVP_PKEY* key) {
  const Bio bio = memory();
  good(PEM_write_bio_PKCS8PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr), "private key");
  return contents(bio.get());
}
std::string textOf(X509_CRL* crl) {
  const Bio bio = memory();
  good(PEM_write_bio_X509_CRL(bio.get(), crl), "list of revocations");
  return contents(bio.get());
}

std::string subjectOf(X509* certificate) {
  const Bio bio = memory();
  good(X509_NAME_print_ex(bio.get(), X509_get_subject_name(certificate), 0, XN_FLAG_RFC2253 & ~ASN1_STRFLGS_ESC_MSB),
       "subject");
  return contents(bio.get());
}

std::string commonNameOf(X509* certificate) {
  char text[256] = "";
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, text, sizeof(text));
  return text;
}

std::string sign(const std::string& document, X509* certificate, EVP_PKEY* key) {
  const Bio in = memory(document), out = memory();
  const Pkcs7 signature(good(PKCS7_sign(certificate, key, nullptr, in.get(), kSigning | PKCS7_STREAM), "signature"));
  good(SMIME_write_PKCS7(out.get(), signature.get(), in.get(), kSigning | PKCS7_STREAM), "signature");
  return contents(out.get());
}

std::string verified(const std::filesystem::path& file, X509* authority) {
  const Bio in = memory(readText(file));
  BIO* part = nullptr;
  const Pkcs7 signature(SMIME_read_PKCS7(in.get(), &part));
  const Bio signed_part(part);
  if (!signature)
    throw Error(file.string() + ": found no signed document (S/MIME): " + takeLastError());
  const Store store(good(X509_STORE_new(), "store"));
  good(X509_STORE_add_cert(store.get(), authority), "store");
  // Dates are checked separately (checkDates() in verify.cpp), with specific messages.
  X509_STORE_set_flags(store.get(), X509_V_FLAG_NO_CHECK_TIME);
  const Bio out = memory();
  if (PKCS7_verify(signature.get(), nullptr, store.get(), signed_part.get(), out.get(), PKCS7_TEXT) <= 0)
    throw Error(file.string() + ": not signed by the authority: " + takeLastError());
  std::string document = contents(out.get());
  std::erase(document, '\r');  // S/MIME lines end with CR LF
  return document;
}

}  // namespace tandem::security
