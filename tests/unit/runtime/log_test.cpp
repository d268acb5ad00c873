// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/log.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/base_sink.h>

#include <cctype>
#include <map>
#include <mutex>
#include <tuple>
#include <vector>

namespace tandem::runtime {
namespace {

TEST(Log, LinesNameTimeServiceAndLevel) {
  testing::internal::CaptureStderr();
  startLog("planner", "info");
  spdlog::debug("not shown");
  spdlog::warn("point {} of {}", 3, 100);
  stopLog();
  std::string text = testing::internal::GetCapturedStderr();
  for (char& letter : text) {
    letter = std::isdigit(static_cast<unsigned char>(letter)) != 0 ? '0' : letter;
  }
  EXPECT_EQ(text, "[0000-00-00T00:00:00.000] [planner] [warning] point 0 of 000\n");
}

/** Counts lines by level. */
class Lines final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  std::map<spdlog::level::level_enum, int> count;

 private:
  void sink_it_(const spdlog::details::log_msg& line) override { ++count[line.level]; }
  void flush_() override {}
};

/// What stderr shows of an info and an error line, and what an added sink gets.
std::pair<std::string, std::map<spdlog::level::level_enum, int>> shownAt(const std::string& level) {
  testing::internal::CaptureStderr();
  startLog("planner", level);
  const auto lines = std::make_shared<Lines>();
  addLogSink(lines);
  spdlog::debug("a detail");
  spdlog::info("a request");
  spdlog::error("a fault");
  stopLog();
  return {testing::internal::GetCapturedStderr(), lines->count};
}

TEST(Log, LevelComesFromOptionThenEnvironmentAndHoldsForTheTerminalOnly) {
  EXPECT_THROW(startLog("planner", "loud"), std::invalid_argument);
  const auto shows = [](const std::string& text, const std::string& line) {
    return text.find(line) != std::string::npos;
  };
  ASSERT_EQ(setenv("TANDEM_LOG", "error", 1), 0);
  for (const auto& [level, info, debug] : std::vector<std::tuple<std::string, bool, bool>>{
           {"", false, false}, {"debug", true, true}, {"off", false, false}}) {
    const auto [text, lines] = shownAt(level);
    EXPECT_EQ(shows(text, "a request"), info) << level;
    EXPECT_EQ(shows(text, "a detail"), debug) << level;
    EXPECT_EQ(shows(text, "a fault"), level != "off") << level;
    // Added sinks are for operators: from info on, always.
    EXPECT_EQ(lines.at(spdlog::level::info), 1) << level;
    EXPECT_EQ(lines.at(spdlog::level::err), 1) << level;
    EXPECT_EQ(lines.contains(spdlog::level::debug), debug) << level;
  }
  unsetenv("TANDEM_LOG");
  EXPECT_TRUE(shows(shownAt("").first, "a request"));
}

}  // namespace
}  // namespace tandem::runtime
