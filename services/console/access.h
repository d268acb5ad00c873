// SPDX-License-Identifier: Apache-2.0
/** @file Access control of the console: tokens, Origin and Host headers. No sockets here.
 *
 * Browsers let any page of the web send requests to servers on this machine. The Origin header, which browsers set,
 * excludes such pages; the Host header excludes foreign names that resolve to this machine (DNS rebinding). */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "services/dds/roles.h"

namespace tandem::console {

/** Access headers of a request; empty if absent. */
struct AccessHeaders {
  std::string host;        ///< header Host
  std::string origin;      ///< header Origin: set by browsers
  std::string fetch_site;  ///< header Sec-Fetch-Site: set by browsers
  std::string bearer;      ///< header Authorization
  std::string cookie;      ///< header Cookie
  std::string query;       ///< of the request target, after '?'
};

/** Decision on a request. */
struct AccessDecision {
  std::optional<dds::Role> role;  ///< kConsoleOperator or kConsoleViewer; empty: refused
  int status = 200;               ///< HTTP status of a refusal
  std::string why;                ///< reason of a refusal
};

/// @throw std::invalid_argument if all users of this machine may read the file. @param where  key and file, for the
/// error text
void expectPrivate(const std::filesystem::path& file, const std::string& where);

/** Decides on requests by their access headers. */
class Access {
 public:
  /// Reads the tokens.
  /// @param secured  the deployment uses DDS Security: commands then require a token
  /// @throw std::invalid_argument with key and file: no token where one is required, a token that is not of kMinToken
  /// to kMaxToken letters, digits, '-', '_', '.', '~', or a file that all users may read.
  Access(const config::Console& console, bool secured, const std::vector<std::string>& own_names);

  static constexpr std::size_t kMinToken = 16, kMaxToken = 256;

  /// Whether the Host is an IP address, "localhost", a name of this machine, or a host of the permitted origins.
  bool knowsHost(std::string_view host) const;
  /// Whether a page of this origin may connect: the origin is the console's (same host and port) or in the list.
  bool knowsOrigin(std::string_view origin, std::string_view host) const;
  /// For all requests except files of the page.
  AccessDecision judge(const AccessHeaders& headers) const;
  /// Role of those who have this token; empty if it is none of the console's.
  std::optional<dds::Role> roleOf(std::string_view token) const;
  /// Whether requests need a token.
  bool asksForToken() const { return !operator_token_.empty(); }
  /// Name of the cookie with the token. It contains the port: browsers send the cookies of a host to all of its ports,
  /// and another console there has other tokens.
  const std::string& cookieName() const { return cookie_name_; }

 private:
  std::string scheme_, cookie_name_;
  std::string operator_token_, viewer_token_;
  std::vector<std::string> origins_, names_;
};

/// Whether two texts are the same, in a time that does not depend on where they differ.
bool sameSecret(std::string_view a, std::string_view b);
/// Value of a parameter in "a=b&c=d"; empty if absent. Tokens need no decoding.
std::string_view parameterOf(std::string_view query, std::string_view name);
/// "a=b&c=d" without all parameters of this name.
std::string withoutParameter(std::string_view query, std::string_view name);
/// Name of a parameter that "a=b&a=c" has twice; empty if there is none.
std::string_view repeatedParameter(std::string_view query);
/// A value without percent escapes; what is no escape is kept.
std::string decoded(std::string_view value);
/// Value of a cookie in "a=b; c=d"; empty if absent.
std::string_view cookieOf(std::string_view cookies, std::string_view name);

}  // namespace tandem::console
