// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "services/console/context.h"
#include "services/console/numbers.h"

namespace tandem::console {
namespace {

/// Paths below this one start, mark and stop a recording.
constexpr std::string_view kRecording = "/api/recording/";

/// Redirects from an address with a valid token to the same one without it, so that it is neither in the address bar
/// nor in the browser's history; a cookie keeps it, which scripts cannot read. Links from other sites may have a token,
/// too.
std::optional<Answer> takeToken(const Context& context, const Request& request) {
  const std::string token(parameterOf(request.query, "token"));
  if (request.path != "/" || !context.access.roleOf(token))
    return std::nullopt;
  const std::string query = withoutParameter(request.query, "token");
  Answer answer;
  answer.status = 303;
  answer.headers = {{"Location", (query.empty() ? "/" : "/?") + query},
                    {"Cache-Control", "no-store"},
                    {"Set-Cookie", context.access.cookieName() + "=" + token + "; Path=/; HttpOnly; SameSite=Strict" +
                                       (context.tls ? "; Secure" : "")}};
  return answer;
}

Answer answerPage(Context& context, const Request& request) {
  if (auto redirection = takeToken(context, request))
    return *redirection;
  Answer answer;
  answer.headers = {{"Content-Security-Policy", std::string(kContentSecurityPolicy)}};
  if (!context.page.present() && request.path == "/") {
    answer.type = "text/html; charset=utf-8";
    answer.body = kNoPage;
    return answer;
  }
  const auto file = context.page.find(request.path, request.gzip);
  if (!file)
    return refuse(context, 404,
                  "not found: " + request.path.substr(0, 100) + "; the page is at /, data is below /api/");
  answer.type = file->type;
  answer.headers.emplace_back("ETag", file->etag);
  answer.headers.emplace_back("Vary", "Accept-Encoding");
  if (file->compressed)
    answer.headers.emplace_back("Content-Encoding", "gzip");
  answer.headers.emplace_back("Cache-Control", file->lasting ? "public, max-age=31536000, immutable" : "no-cache");
  if (request.known_etag == file->etag) {
    answer.status = 304;
    return answer;
  }
  std::ifstream stream(file->path, std::ios::binary);
  answer.body.assign(std::istreambuf_iterator<char>(stream), {});
  if (!stream)
    return refuse(context, 500, "the console cannot read this file of the page; install Tandem again");
  return answer;
}

}  // namespace

std::optional<double> rateOf(std::string_view query) {
  const std::string_view text = parameterOf(query, "rate");
  if (text.empty())
    return 0.0;
  const auto rate = finiteNumber(text);
  return rate && *rate >= kLeastRate && *rate <= kMostRate ? rate : std::nullopt;
}

Answer refuse(Context& context, int status, const std::string& why, const std::string& allowed) {
  if (status != 404)
    ++context.turned_away;
  Answer answer;
  answer.status = status;
  answer.body = nlohmann::json{{"error", why}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  if (status == 405)
    answer.headers.emplace_back("Allow", allowed);
  if (status == 401)
    answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
}

Answer answer(Context& context, const Request& request) {
  // Requests that change something are posts, to which browsers add the Origin.
  const bool changes = request.path.starts_with(kRecording);
  if (changes ? !request.post : !request.get && !request.head)
    return refuse(context, 405, changes ? "expected POST" : "expected GET or HEAD", changes ? "POST" : "GET, HEAD");
  if (request.path == "/healthz")
    return {200, "application/json", "{\"status\":\"ok\"}\n"};
  if (!context.access.knowsHost(request.access_headers.host))
    return refuse(context, 403, context.access.judge(request.access_headers).why);
  if (!request.path.starts_with("/api/"))
    return answerPage(context, request);
  const AccessDecision decision = context.access.judge(request.access_headers);
  if (!decision.role)
    return refuse(context, decision.status, decision.why);
  if (changes && *decision.role != dds::Role::kConsoleOperator)
    return refuse(context, 403, "viewers may not record");
  try {
    const auto path = std::string_view(request.path).substr(4);
    if (const auto found = context.api(path, request.query, *decision.role, request.address))
      return {200, found->type, found->body, {{"Cache-Control", "no-store"}}, found->later};
  } catch (const std::invalid_argument& invalid) {
    return refuse(context, 400, invalid.what());
  }
  return refuse(context, 404,
                "expected /api/robot, /api/trajectories, /api/shape, /api/span, /api/recording, /api/recordings, "
                "/api/events, /api/stats or /api/clock");
}

}  // namespace tandem::console
