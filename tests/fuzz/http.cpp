// SPDX-License-Identifier: Apache-2.0
/** @file HTTP requests to the console: bytes as a client sends them, through Beast's parser, to the decision and the
 * answer. Without a token there is no data and no cookie, files outside of the page's folder are not served, and every
 * refusal is JSON. */
#include <sys/stat.h>

#include <boost/beast/http/parser.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "services/console/request.h"
#include "services/console/server.h"
#include "tests/fuzz/harness.h"

using namespace tandem;
using fuzz::expect;

namespace {

namespace fs = std::filesystem;
namespace http = boost::beast::http;

const std::string kOperatorToken = "operator-token-of-the-fuzzer";
const std::string kViewerToken = "viewer-token-of-the-fuzzer--";
const std::string kSecret = "the text of a file outside of the page";
const std::string kData = "{\"data\":true}";

/** A console's decisions: a folder with a page, tokens, and beside the page a file that must not be served. */
class Console {
 public:
  Console() {
    fs::create_directories(folder_.path() / "page/assets");
    write("page/index.html", "<html></html>");
    write("page/assets/app.js", "start()");
    write("secret.txt", kSecret);
    fs::create_symlink(folder_.path() / "secret.txt", folder_.path() / "page/link.txt");
    write("operator", kOperatorToken);
    write("viewer", kViewerToken);
    config::Console options;
    options.operator_token = folder_.path() / "operator";
    options.viewer_token = folder_.path() / "viewer";
    options.origins = {"https://tools.example:8080"};
    access_.emplace(options, false, std::vector<std::string>{"robot"});
    page_.emplace(folder_.path() / "page");
  }

  const console::Access& access() const { return *access_; }
  const console::Page& page() const { return *page_; }

 private:
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name) << text;
    chmod((folder_.path() / name).c_str(), 0600);
  }

  fuzz::TemporaryFolder folder_;
  std::optional<console::Access> access_;
  std::optional<console::Page> page_;
};

bool hasToken(std::string_view bytes) {
  return bytes.find(kOperatorToken) != std::string_view::npos || bytes.find(kViewerToken) != std::string_view::npos;
}

void check(const console::Request& request, const console::Answer& answer, std::string_view bytes) {
  const std::string about = std::to_string(answer.status) + " " + answer.body;
  expect(answer.status != 200 || answer.body.find(kSecret) == std::string::npos,
         "no file outside of the page's folder is served", about);
  if (!hasToken(bytes)) {
    expect(answer.body != kData, "there is no data without a token", about);
    for (const auto& [name, value] : answer.headers)
      expect(name != "Set-Cookie", "there is no cookie without a token", value);
  }
  for (const auto& [name, value] : answer.headers)
    expect(value.find_first_of("\r\n") == std::string::npos, "a header is one line", name);
  if (answer.status == 200 && request.path != "/healthz")
    expect(!request.access_headers.host.empty(), "a host is named", about);
  if (answer.status >= 400)
    expect(!nlohmann::json::parse(answer.body).at("error").get<std::string>().empty(), "a refusal has a reason", about);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Console ours;
  static std::uint64_t nothing = 0;
  static boost::asio::thread_pool worker{1};
  // An answer asks the hub nothing.
  console::Context context{reinterpret_cast<console::Hub&>(nothing), ours.access(), ours.page(),
                           [](std::string_view path, std::string_view, dds::Role, const std::string&) {
                             return path == "/robot" ? std::optional(kData) : std::nullopt;
                           },
                           worker};
  const std::string_view bytes = fuzz::textOf(data, size);
  http::request_parser<http::empty_body> parser;
  parser.header_limit(console::kMaxHeader);
  parser.body_limit(0);
  boost::beast::error_code error;
  parser.put(boost::asio::buffer(bytes.data(), bytes.size()), error);
  if (error || !parser.is_header_done())
    return 0;
  const console::Request request = console::requestOf(parser.get());
  check(request, console::answer(context, request), bytes);
  const auto decision = context.access.judge(request.access_headers);
  expect(decision.role.has_value() == (decision.status == 200), "a refusal has a status");
  expect(!decision.role || hasToken(bytes), "there is no role without a token");
  if (const auto rate = console::rateOf(request.query))
    expect(*rate == 0.0 || (*rate >= 0.1 && *rate <= 1000.0), "a rate is inside its range");
  return 0;
}
