// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/log.h"

#include <gtest/gtest.h>

#include <cctype>

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

}  // namespace
}  // namespace tandem::runtime
