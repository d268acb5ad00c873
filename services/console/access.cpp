// SPDX-License-Identifier: Apache-2.0
#include "services/console/access.h"

#include <arpa/inet.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

namespace tandem::console {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return result;
}

bool isTokenLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("-_.~").find(c) != std::string_view::npos;
}

std::string readToken(const std::filesystem::path& file, const char* key) {
  const std::string where = "console." + std::string(key) + ": " + file.string();
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw std::invalid_argument(where + ": cannot be opened for reading");
  expectPrivate(file, where);
  std::string token{std::istreambuf_iterator<char>(stream), {}};
  while (token.ends_with('\n') || token.ends_with('\r'))
    token.pop_back();
  if (token.size() < Access::kMinToken || token.size() > Access::kMaxToken ||
      !std::all_of(token.begin(), token.end(), isTokenLetter))
    throw std::invalid_argument(where + ": expected " + std::to_string(Access::kMinToken) + " to " +
                                std::to_string(Access::kMaxToken) +
                                " letters, digits, '-', '_', '.' or '~', e.g. from `openssl rand -hex 32`");
  return token;
}

/// "name" of "name:port", "[::1]" of "[::1]:port".
std::string_view nameOf(std::string_view host) {
  if (host.starts_with('[')) {
    const auto end = host.find(']');
    return end == std::string_view::npos ? host : host.substr(0, end + 1);
  }
  return host.substr(0, host.find(':'));
}

bool isAddress(std::string_view name) {
  in6_addr six{};
  in_addr four{};
  if (name.starts_with('[') && name.ends_with(']'))
    return inet_pton(AF_INET6, std::string(name.substr(1, name.size() - 2)).c_str(), &six) == 1;
  return inet_pton(AF_INET, std::string(name).c_str(), &four) == 1;
}

template <class Next>
std::string_view valueOf(std::string_view pairs, std::string_view name, char separator, Next trim) {
  for (std::size_t begin = 0; begin <= pairs.size();) {
    const std::size_t end = std::min(pairs.find(separator, begin), pairs.size());
    const std::string_view pair = trim(pairs.substr(begin, end - begin));
    if (pair.starts_with(name) && pair.size() > name.size() && pair[name.size()] == '=')
      return pair.substr(name.size() + 1);
    begin = end + 1;
  }
  return {};
}

AccessDecision refusal(int status, std::string why) { return {std::nullopt, status, std::move(why)}; }

std::vector<std::string_view> parametersOf(std::string_view query) {
  std::vector<std::string_view> found;
  for (std::size_t begin = 0; begin < query.size();) {
    const std::size_t end = std::min(query.find('&', begin), query.size());
    found.push_back(query.substr(begin, end - begin));
    begin = end + 1;
  }
  return found;
}

std::string_view nameOfParameter(std::string_view pair) { return pair.substr(0, pair.find('=')); }

}  // namespace

void expectPrivate(const std::filesystem::path& file, const std::string& where) {
  struct stat about {};
  if (stat(file.c_str(), &about) == 0 && (about.st_mode & S_IROTH) != 0)
    throw std::invalid_argument(where +
                                ": found a file that every user of this machine can read, expected one that others "
                                "cannot read, e.g. by mode 0600");
}

bool sameSecret(std::string_view a, std::string_view b) {
  // Always compares kMaxToken characters, so that the time does not depend on the first difference.
  std::size_t difference = a.size() ^ b.size();
  for (std::size_t i = 0; i < Access::kMaxToken; ++i)
    difference |=
        static_cast<unsigned char>(i < a.size() ? a[i] : 0) ^ static_cast<unsigned char>(i < b.size() ? b[i] : 0);
  return difference == 0;
}

std::string_view parameterOf(std::string_view query, std::string_view name) {
  return valueOf(query, name, '&', [](std::string_view pair) { return pair; });
}

std::string withoutParameter(std::string_view query, std::string_view name) {
  std::string kept;
  for (const std::string_view pair : parametersOf(query)) {
    if (nameOfParameter(pair) != name)
      kept.append(kept.empty() ? "" : "&").append(pair);
  }
  return kept;
}

std::string_view repeatedParameter(std::string_view query) {
  std::set<std::string_view> names;
  for (const std::string_view pair : parametersOf(query)) {
    if (!names.insert(nameOfParameter(pair)).second)
      return nameOfParameter(pair);
  }
  return {};
}

std::string decoded(std::string_view value) {
  std::string text;
  for (std::size_t k = 0; k < value.size(); ++k) {
    unsigned char byte = 0;
    const char* const digits = value.data() + k + 1;
    if (value[k] == '%' && k + 2 < value.size() &&
        std::from_chars(digits, digits + 2, byte, 16) == std::from_chars_result{digits + 2, {}}) {
      text += static_cast<char>(byte);
      k += 2;
    } else {
      text += value[k];
    }
  }
  return text;
}

std::string_view cookieOf(std::string_view cookies, std::string_view name) {
  return valueOf(cookies, name, ';', [](std::string_view pair) {
    while (pair.starts_with(' '))
      pair.remove_prefix(1);
    return pair;
  });
}

Access::Access(const config::Console& console, bool secured, const std::vector<std::string>& own_names)
    : scheme_(console.tls() ? "https://" : "http://"),
      cookie_name_("tandem_token_" + std::to_string(console.port)),
      origins_(console.origins) {
  if (!console.operator_token.empty())
    operator_token_ = readToken(console.operator_token, "operator_token");
  else if (secured || !console.loopback())
    throw std::invalid_argument(
        "console.operator_token: is missing; required with `security`, and for a console.address that is not loopback");
  if (!console.viewer_token.empty())
    viewer_token_ = readToken(console.viewer_token, "viewer_token");
  if (!viewer_token_.empty() && sameSecret(operator_token_, viewer_token_))
    throw std::invalid_argument("console.viewer_token: found the same text as in operator_token, expected another");
  names_ = {"localhost"};
  for (const std::string& name : own_names) {
    names_.push_back(lower(name));
    names_.push_back(lower(name) + ".local");
  }
  for (std::string& origin : origins_) {
    origin = lower(origin);
    names_.emplace_back(nameOf(std::string_view(origin).substr(origin.find("//") + 2)));
  }
}

bool Access::knowsHost(std::string_view host) const {
  const std::string name(nameOf(lower(host)));
  return isAddress(name) || std::find(names_.begin(), names_.end(), name) != names_.end();
}

bool Access::knowsOrigin(std::string_view origin, std::string_view host) const {
  const std::string here = lower(origin);
  // Origin of programs with pages of their own (Electron): no page of the web has it.
  if (here == "file://")
    return true;
  return here == scheme_ + lower(host) || std::find(origins_.begin(), origins_.end(), here) != origins_.end();
}

std::optional<dds::Role> Access::roleOf(std::string_view token) const {
  // Compares both, so that the time does not reveal which one matched.
  const bool commands = sameSecret(token, operator_token_), looks = sameSecret(token, viewer_token_);
  if (token.empty() || !(commands || looks))
    return std::nullopt;
  return commands ? dds::Role::kConsoleOperator : dds::Role::kConsoleViewer;
}

AccessDecision Access::judge(const AccessHeaders& headers) const {
  if (!knowsHost(headers.host))
    return refusal(
        403, "Host '" + headers.host.substr(0, 100) +
                 "': expected an address, localhost or a name of this machine (console.origins lists further ones)");
  const bool cross_site = headers.fetch_site == "cross-site" && headers.origin.empty();
  if (cross_site || (!headers.origin.empty() && !knowsOrigin(headers.origin, headers.host)))
    return refusal(403, "Origin '" + headers.origin.substr(0, 100) +
                            "': pages of other origins may not connect; console.origins lists the permitted ones");
  if (!asksForToken())
    return {dds::Role::kConsoleOperator, 200, ""};
  std::string_view token = parameterOf(headers.query, "token");
  if (token.empty() && headers.bearer.starts_with("Bearer "))
    token = std::string_view(headers.bearer).substr(7);
  if (token.empty())
    token = cookieOf(headers.cookie, cookie_name_);
  if (const auto role = roleOf(token))
    return {role, 200, ""};
  return refusal(
      401, std::string(token.empty() ? "This console requires a token, and the request has none."
                                     : "The token of this request is not one of this console's tokens.") +
               " Copy the token from the file that `operator_token` (to command) or `viewer_token` (to watch and stop) "
               "under `console` in the deployment names. In a browser, open this console's address with "
               "/?token=TOKEN at its end; a program sends the header `Authorization: Bearer TOKEN`.");
}

}  // namespace tandem::console
