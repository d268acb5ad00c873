// SPDX-License-Identifier: Apache-2.0
/** @file Access control of the console: tokens, Origin and Host headers. No sockets here.
 *
 * Browsers let any page of the web talk to servers on this machine. What keeps such pages out is the Origin that
 * browsers state, and what keeps out a name of others that leads here (DNS rebinding) is the Host that they ask for.
 */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "services/dds/roles.h"

namespace tandem::console {

/** What a request says of itself; empty: nothing. */
struct AccessHeaders {
  std::string host;        ///< header Host
  std::string origin;      ///< header Origin: of browsers' pages
  std::string fetch_site;  ///< header Sec-Fetch-Site: of browsers
  std::string bearer;      ///< header Authorization
  std::string cookie;      ///< header Cookie
  std::string query;       ///< of the request's target, behind '?'
};

/** What becomes of a request. */
struct AccessDecision {
  std::optional<dds::Role> role;  ///< kConsoleOperator or kConsoleViewer; none: refused
  int status = 200;               ///< of HTTP, where it is refused
  std::string why;                ///< for people, where it is refused
  bool show_cookie = false;       ///< the token came in the query: a browser shall keep it
};

/// Name of the cookie that a browser keeps the token in.
inline constexpr const char* kTokenCookie = "tandem_token";

/// @throw std::invalid_argument where everybody on this machine may read the file. @param where  key and file, for
/// people
void expectPrivate(const std::filesystem::path& file, const std::string& where);

/** Judges access headers. */
class Access {
 public:
  /// Reads the tokens.
  /// @param secured  the deployment is: then nobody may command without a token
  /// @throw std::invalid_argument that names key and file: no token where one is needed, or a file with another one
  /// than kMinToken to kMaxToken letters, digits, '-', '_', '.', '~', or one that everybody may read.
  Access(const config::Console& console, bool secured, const std::vector<std::string>& own_names);

  static constexpr std::size_t kMinToken = 16, kMaxToken = 256;

  /// Whether the Host is one of this machine: an address, "localhost", its names, or a host of the origins.
  bool knowsHost(std::string_view host) const;
  /// Whether a page of this origin may talk to us: it is ours (same host and port), or in the list.
  bool knowsOrigin(std::string_view origin, std::string_view host) const;
  /// For everything but files of the page.
  AccessDecision judge(const AccessHeaders& headers) const;
  /// Whether tokens are asked for.
  bool asksForToken() const { return !operator_token_.empty(); }

 private:
  std::string scheme_;
  std::string operator_token_, viewer_token_;
  std::vector<std::string> origins_, names_;
};

/// Whether two texts are the same, in a time that does not tell where they differ.
bool sameSecret(std::string_view a, std::string_view b);
/// Value of a parameter in "a=b&c=d"; empty: none. Tokens need no decoding.
std::string_view parameterOf(std::string_view query, std::string_view name);
/// Value of a cookie in "a=b; c=d"; empty: none.
std::string_view cookieOf(std::string_view cookies, std::string_view name);

}  // namespace tandem::console
