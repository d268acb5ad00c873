// SPDX-License-Identifier: Apache-2.0
/** @file Private: RAII wrappers of OpenSSL objects, PEM files, error texts. */
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <filesystem>
#include <memory>
#include <string>

#include "services/security/authority.h"

namespace tandem::security {

template <auto kRelease>
struct Release {
  template <class T>
  void operator()(T* object) const {
    kRelease(object);
  }
};
using Bio = std::unique_ptr<BIO, Release<BIO_free_all>>;
using Key = std::unique_ptr<EVP_PKEY, Release<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Release<X509_free>>;
using Crl = std::unique_ptr<X509_CRL, Release<X509_CRL_free>>;
using Store = std::unique_ptr<X509_STORE, Release<X509_STORE_free>>;
using Pkcs7 = std::unique_ptr<PKCS7, Release<PKCS7_free>>;

/// Text of OpenSSL's last error; clears its error queue.
std::string takeLastError();

/// The result of a successful call. @throw Error "WHAT: error text".
template <class T>
T* good(T* result, const std::string& what) {
  if (result == nullptr)
    throw Error(what + ": " + takeLastError());
  return result;
}
inline void good(int result, const std::string& what) {
  if (result <= 0)
    throw Error(what + ": " + takeLastError());
}

/// @throw Error for a missing file, or one with another content.
Certificate readCertificate(const std::filesystem::path& file);
Key readKey(const std::filesystem::path& file);
Crl readCrl(const std::filesystem::path& file);

/// Replaces a file atomically; `secret` files are readable only by their owner.
void writeFile(const std::filesystem::path& file, const std::string& text, bool secret = false);
std::string readText(const std::filesystem::path& file);

/// As PEM.
std::string textOf(X509* certificate);
std::string textOf(EVP_PKEY* key);
std::string textOf(X509_CRL* crl);

/// "CN=control,OU=control,O=tandem": the order of RFC 2253, which permissions must have.
std::string subjectOf(X509* certificate);
std::string commonNameOf(X509* certificate);

/// Signs a document as S/MIME.
std::string sign(const std::string& document, X509* certificate, EVP_PKEY* key);

/// The document of a signed file. @throw Error if it is not signed by the authority.
std::string verified(const std::filesystem::path& file, X509* authority);

}  // namespace tandem::security
