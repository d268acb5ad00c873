// SPDX-License-Identifier: Apache-2.0
/** @file Recording from the page: state, marks and refusals, and the requests that may start one. Capture has its own
 * tests. */
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <random>

#include "config/robot_files.h"
#include "recording/reader.h"
#include "services/console/access.h"
#include "services/console/context.h"
#include "services/console/recording.h"
#include "services/runtime/process.h"

namespace tandem::console {
namespace {

namespace fs = std::filesystem;

class RecordingOfThePage : public testing::Test {
 protected:
  RecordingOfThePage()
      : deployment_(config::loadDeployment(config::findFile("laptop", "deployment"))),
        robot_(config::loadAnyRobot(deployment_)),
        folder_(fs::temp_directory_path() / ("tandem-recording-" + std::to_string(getpid()))) {
    options_.domain = 90 + static_cast<int>(getpid() % 10);
    options_.prefix = "recording_test";
    options_.name = "recording-test";
  }
  ~RecordingOfThePage() override { fs::remove_all(folder_); }

  /// The state once it meets the condition.
  template <class Condition>
  nlohmann::ordered_json until(const Recording& recording, Condition condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < end) {
      if (auto state = recording.state(); condition(state))
        return state;
      std::this_thread::yield();
    }
    ADD_FAILURE() << recording.state();
    return recording.state();
  }

  config::Deployment deployment_;
  config::Robot robot_;
  fs::path folder_;
  dds::BusOptions options_;
};

TEST_F(RecordingOfThePage, StartsMarksAndStops) {
  Recording recording(deployment_, robot_, options_, folder_);
  EXPECT_EQ(recording.state()["recording"], false);
  EXPECT_THROW(recording.stop(), std::invalid_argument);
  EXPECT_THROW(recording.mark("early"), std::invalid_argument);
  recording.start();
  EXPECT_THROW(recording.start(), std::invalid_argument);
  EXPECT_THROW(recording.mark(""), std::invalid_argument);
  EXPECT_THROW(recording.mark(std::string(201, 'x')), std::invalid_argument);
  recording.mark("first contact");
  recording.mark("Größe");
  recording.stop();
  const auto state = until(recording, [](const auto& now) { return now["recording"] == false; });
  EXPECT_EQ(state["problem"], "");
  EXPECT_EQ(state["marks"].size(), 2u);
  const recording::Reader reader(state["file"].template get<std::string>());
  std::map<std::string, std::string> marks;
  for (const auto& metadata : reader.metadata()) {
    if (metadata.name.starts_with("mark "))
      marks[metadata.name] = metadata.values.at("text");
  }
  EXPECT_EQ(marks, (std::map<std::string, std::string>{{"mark 1", "first contact"}, {"mark 2", "Größe"}}));
}

TEST_F(RecordingOfThePage, AFolderThatCannotBeWrittenIsAProblemAndNoEnd) {
  Recording recording(deployment_, robot_, options_, "/proc/nowhere");
  for (int round = 0; round < 2; ++round) {
    recording.start();
    const auto state = until(recording, [](const auto& now) { return now["recording"] == false; });
    EXPECT_NE(state["problem"].template get<std::string>().find("/proc/nowhere"), std::string::npos);
  }
}

TEST(RequestsThatRecord, ArePostsOfOperators) {
  const config::Console options;
  const Access access(options, false, {});
  const Page page("");
  std::vector<std::string> asked;
  boost::asio::thread_pool worker{1};
  Context context{*reinterpret_cast<Hub*>(&asked), access, page,
                  [&](std::string_view path, std::string_view, dds::Role, const std::string&) {
                    asked.emplace_back(path);
                    return std::optional<std::string>("{}");
                  },
                  worker};
  const auto status = [&](const std::string& path, bool post, const std::string& origin = "") {
    Request request;
    request.get = !post;
    request.post = post;
    request.path = path;
    request.access_headers.host = "127.0.0.1:8765";
    request.access_headers.origin = origin;
    return answer(context, request).status;
  };
  EXPECT_EQ(status("/api/recording/start", false), 405);
  EXPECT_EQ(status("/api/recording", true), 405);
  EXPECT_EQ(status("/api/robot", true), 405);
  EXPECT_EQ(status("/api/recording/start", true, "http://evil.example"), 403);
  EXPECT_TRUE(asked.empty());
  EXPECT_EQ(status("/api/recording/start", true, "http://127.0.0.1:8765"), 200);
  EXPECT_EQ(status("/api/recording", false), 200);
  EXPECT_EQ(status("/api/recordings/about", true), 405);
  EXPECT_EQ(status("/api/recordings/samples", false, "http://evil.example"), 403);
  EXPECT_EQ(status("/api/recordings", false), 200);
  EXPECT_EQ(asked, (std::vector<std::string>{"/recording/start", "/recording", "/recordings"}));
}

TEST(Decoded, ReversesPercentEncoding) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 200; ++round) {
    std::string text, encoded;
    for (std::size_t k = random() % 20; k > 0; --k) {
      const auto byte = static_cast<unsigned char>(random());
      char escape[4];
      std::snprintf(escape, sizeof escape, "%%%02X", byte);
      text += static_cast<char>(byte);
      encoded += byte != '%' && random() % 2 == 0 ? std::string(1, static_cast<char>(byte)) : escape;
    }
    EXPECT_EQ(decoded(encoded), text);
  }
  for (const char* broken : {"%", "%4", "a%zz", "100%"})
    EXPECT_EQ(decoded(broken), broken);
}

}  // namespace
}  // namespace tandem::console
