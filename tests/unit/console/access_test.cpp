// SPDX-License-Identifier: Apache-2.0
/** @file Access to the console, and the files of its page, without sockets. */
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <random>

#include "services/console/access.h"
#include "services/console/page.h"

namespace tandem::console {
namespace {

namespace fs = std::filesystem;

/** A temporary folder, removed with the test. */
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "tandem-console-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path write(const std::string& name, const std::string& text, mode_t mode = 0600) const {
    fs::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name) << text;
    chmod((path_ / name).c_str(), mode);
    return path_ / name;
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

config::Console withTokens(const Folder& folder) {
  config::Console console;
  console.operator_token = folder.write("operator", "operator-token-0123456789\n");
  console.viewer_token = folder.write("viewer", "viewer-token-0123456789");
  console.origins = {"https://Tools.example:8443"};
  return console;
}

TEST(AccessRules, HostsAndOrigins) {
  const Access access(config::Console{.origins = {"https://tools.example:8443"}}, false, {"Lab-PC"});
  for (const char* host : {"localhost", "LOCALHOST:8765", "127.0.0.1:8765", "10.1.2.3", "[::1]:8765", "lab-pc:1",
                           "lab-pc.local", "tools.example"})
    EXPECT_TRUE(access.knowsHost(host)) << host;
  for (const char* host : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example:8765", "127.0.0.1x",
                           "1.2.3", "[::1", "[evil]", "lab-pc.evil"})
    EXPECT_FALSE(access.knowsHost(host)) << host;
  const auto known = [&](const char* origin) { return access.knowsOrigin(origin, "localhost:8765"); };
  EXPECT_TRUE(known("http://localhost:8765"));
  EXPECT_TRUE(known("http://LOCALHOST:8765"));
  EXPECT_TRUE(known("https://tools.example:8443"));
  EXPECT_TRUE(known("file://"));
  for (const char* origin : {"null", "http://localhost", "https://localhost:8765", "http://localhost:8766",
                             "http://localhost:8765.evil.example", "https://tools.example", "http://evil.example",
                             "http://localhost:8765/", "file://evil"})
    EXPECT_FALSE(known(origin)) << origin;
}

TEST(AccessRules, WithoutTokensThisMachineCommands) {
  const Access access(config::Console{}, false, {});
  AccessHeaders here{.host = "localhost:8765"};
  EXPECT_EQ(access.judge(here).role, dds::Role::kConsoleOperator);
  here.origin = "http://localhost:8765";
  EXPECT_EQ(access.judge(here).role, dds::Role::kConsoleOperator);
  here.origin = "http://evil.example";
  EXPECT_EQ(access.judge(here).status, 403);
  EXPECT_EQ(access.judge({.host = "evil.example:8765"}).status, 403);
  EXPECT_EQ(access.judge({.host = "localhost", .fetch_site = "cross-site"}).status, 403);
}

TEST(AccessRules, TokensInEveryPlace) {
  const Folder folder;
  const Access access(withTokens(folder), true, {});
  const std::string commands = "operator-token-0123456789", looks = "viewer-token-0123456789";
  const auto judge = [&](const AccessHeaders& headers) { return access.judge(headers); };
  EXPECT_EQ(judge({.host = "localhost", .query = "a=b&token=" + commands}).role, dds::Role::kConsoleOperator);
  EXPECT_EQ(access.roleOf(commands), dds::Role::kConsoleOperator);
  EXPECT_EQ(access.roleOf(looks), dds::Role::kConsoleViewer);
  EXPECT_EQ(access.roleOf(""), std::nullopt);
  EXPECT_EQ(judge({.host = "localhost", .bearer = "Bearer " + looks}).role, dds::Role::kConsoleViewer);
  EXPECT_EQ(judge({.host = "localhost", .cookie = "x=1; tandem_token_8765=" + looks}).role, dds::Role::kConsoleViewer);
  EXPECT_EQ(judge({.host = "localhost", .cookie = "tandem_token_8766=" + looks}).status, 401) << "of another console";
  for (const std::string& wrong : {std::string(), commands + "x", commands.substr(1), looks + looks,
                                   std::string(5000, 'o'), std::string("operator-token-012345678\0", 25)}) {
    const AccessDecision decision = judge({.host = "localhost", .query = "token=" + wrong});
    EXPECT_EQ(decision.role, std::nullopt) << wrong.substr(0, 40);
    EXPECT_EQ(decision.status, 401);
    for (const char* step : {"operator_token", "/?token=TOKEN", "Authorization: Bearer TOKEN"})
      EXPECT_NE(decision.why.find(step), std::string::npos) << step << " is not in: " << decision.why;
    EXPECT_EQ(decision.why.find(commands), std::string::npos) << "the token is commanded to nobody";
  }
  EXPECT_EQ(judge({.host = "localhost", .query = "xtoken=" + commands}).status, 401);
}

TEST(AccessRules, ParametersAreFoundRemovedAndCounted) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 300; ++round) {
    std::string query, expected;
    std::map<std::string, int> counts;
    for (unsigned k = 0; k < random() % 6; ++k) {
      const std::string name = std::array{"token", "rate", "xtoken", "tok", "b"}[random() % 5];
      const std::string pair = random() % 4 == 0 ? name : name + "=" + std::to_string(random() % 3);
      query += (query.empty() ? "" : "&") + pair;
      if (name != "token")
        expected += (expected.empty() ? "" : "&") + pair;
      ++counts[name];
    }
    EXPECT_EQ(withoutParameter(query, "token"), expected) << query;
    const std::string repeated(repeatedParameter(query));
    const bool any = std::any_of(counts.begin(), counts.end(), [](const auto& entry) { return entry.second > 1; });
    EXPECT_EQ(!repeated.empty(), any) << query;
    EXPECT_TRUE(repeated.empty() || counts.at(repeated) > 1) << query;
  }
}

TEST(AccessRules, InvalidTokenFilesAreRefused) {
  const Folder folder;
  const auto refusal = [](const config::Console& console, bool secured) -> std::string {
    try {
      const Access access(console, secured, {});
      return "";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  };
  const auto names = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(names(refusal({}, true), "console.operator_token: is missing"));
  EXPECT_TRUE(names(refusal({.address = "10.0.0.1"}, false), "console.operator_token: is missing"));
  config::Console console = withTokens(folder);
  EXPECT_EQ(refusal(console, true), "");
  console.operator_token = folder.write("open", "operator-token-0123456789", 0644);
  EXPECT_TRUE(names(refusal(console, false), "by mode 0600"));
  console.operator_token = folder.write("short", "short");
  EXPECT_TRUE(names(refusal(console, false), "expected 16 to 256"));
  console.operator_token = folder.write("spaces", "operator token 0123456789");
  EXPECT_TRUE(names(refusal(console, false), "spaces: expected 16 to 256 letters"));
  console.operator_token = folder.path() / "nowhere";
  EXPECT_TRUE(names(refusal(console, false), "nowhere: cannot be opened"));
  console = withTokens(folder);
  console.viewer_token = console.operator_token;
  EXPECT_TRUE(names(refusal(console, false), "console.viewer_token: found the same text"));
}

TEST(PageFiles, NothingOutsideTheFolder) {
  const Folder folder;
  folder.write("page/index.html", "<html>");
  folder.write("page/assets/a-1.js", "1");
  folder.write("page/.hidden", "no");
  folder.write("secret.txt", "no");
  fs::create_symlink(folder.path() / "secret.txt", folder.path() / "page/link.txt");
  const Page page(folder.path() / "page");
  ASSERT_TRUE(page.present());
  EXPECT_EQ(page.find("/", false)->type, "text/html; charset=utf-8");
  EXPECT_EQ(page.find("/assets/a-1.js", false)->type, "text/javascript; charset=utf-8");
  EXPECT_TRUE(page.find("/assets/a-1.js", false)->lasting);
  const std::string before = page.find("/index.html", false)->etag;
  folder.write("page/index.html", "<html><body>");
  EXPECT_NE(page.find("/index.html", false)->etag, before);
  for (const char* path :
       {"", "index.html", "/../secret.txt", "/assets/../../secret.txt", "/%2e%2e/secret.txt", "/link.txt", "/.hidden",
        "/assets", "/assets/", "//etc/passwd", "/nothing", "/index.html/x", "/..\\secret.txt"})
    EXPECT_FALSE(page.find(path, false)) << path;
  EXPECT_FALSE(page.find(std::string("/index.html\0", 12), false));
  EXPECT_FALSE(Page(folder.path()).present()) << "no index.html";
  EXPECT_FALSE(Page("").find("/", false));
}

TEST(PageFiles, CompressedCopiesForClientsThatAcceptThem) {
  const Folder folder;
  folder.write("index.html", "<html>");
  const fs::path file = folder.write("assets/a-1.js", "1"), copy = folder.write("assets/a-1.js.gz", "gzip");
  const Page page(folder.path());
  const auto plain = page.find("/assets/a-1.js", false), small = page.find("/assets/a-1.js", true);
  EXPECT_FALSE(plain->compressed);
  EXPECT_EQ(plain->path.filename(), "a-1.js");
  EXPECT_TRUE(small->compressed && small->lasting);
  EXPECT_EQ(small->path.filename(), "a-1.js.gz");
  EXPECT_EQ(small->type, "text/javascript; charset=utf-8");
  EXPECT_NE(small->etag, plain->etag);
  EXPECT_FALSE(page.find("/index.html", true)->compressed) << "there is no copy of it";
  fs::last_write_time(copy, fs::last_write_time(file) - std::chrono::seconds(1));
  EXPECT_FALSE(page.find("/assets/a-1.js", true)->compressed) << "the copy is of an older file";
  for (const char* yes : {"gzip", "br, gzip", "deflate,\tgzip;q=0.5", "*", "gzip;q=1.000"})
    EXPECT_TRUE(acceptsGzip(yes)) << yes;
  for (const char* no : {"", "br", "gzip;q=0", "gzip; q=0.000", "xgzip", "identity, deflate", "*;q=0"})
    EXPECT_FALSE(acceptsGzip(no)) << no;
}

}  // namespace
}  // namespace tandem::console
