// SPDX-License-Identifier: Apache-2.0
#include "services/common/log.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <cctype>
#include <sstream>

namespace tandem::service {
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

TEST(Log, LevelComesFromOptionThenEnvironment) {
  EXPECT_THROW(startLog("planner", "loud"), std::invalid_argument);
  ASSERT_EQ(setenv("TANDEM_LOG", "error", 1), 0);
  startLog("planner");
  EXPECT_EQ(spdlog::default_logger()->level(), spdlog::level::err);
  startLog("planner", "debug");
  EXPECT_EQ(spdlog::default_logger()->level(), spdlog::level::debug);
  unsetenv("TANDEM_LOG");
  startLog("planner");
  EXPECT_EQ(spdlog::default_logger()->level(), spdlog::level::info);
  stopLog();
}

TEST(PeriodicLog, CutsLongLinesAndTellsWhatWasDropped) {
  std::ostringstream out;
  auto logger = std::make_shared<spdlog::logger>("loop", std::make_shared<spdlog::sinks::ostream_sink_mt>(out));
  logger->set_pattern("%l %v");
  Outbox outbox;
  PeriodicLog log(outbox, logger);
  const std::string text(1000, 'x');
  log.error("{}", text);
  for (int i = 0; i < 300; ++i) {
    log.info("cycle {}", i);
  }
  EXPECT_EQ(log.dropped(), 45u);  // 301 lines into a ring of 256
  outbox.start();
  outbox.stop();
  EXPECT_EQ(out.str().substr(0, 6 + 240 + 1), "error " + std::string(240, 'x') + "\n");
  EXPECT_NE(out.str().find("info cycle 254\n"), std::string::npos);
  EXPECT_EQ(out.str().find("cycle 255"), std::string::npos);
  log.warn("half {:.1f}", 0.5);
  outbox.start();
  outbox.stop();
  EXPECT_NE(out.str().find("warning 45 lines of the periodic thread were dropped\nwarning half 0.5\n"),
            std::string::npos)
      << out.str();
}

}  // namespace
}  // namespace tandem::service
