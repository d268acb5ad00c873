// SPDX-License-Identifier: Apache-2.0
/** @file YAML of requests to planning: trajectories and paths. What parses is finite and is written as text that parses
 * to the same text; errors name origin, line and column. */
#include "config/config.h"
#include "config/path.h"
#include "tests/fuzz/harness.h"

using namespace tandem;
using fuzz::expect;

namespace {

constexpr const char* kOrigin = "planning/request";

void checkTrajectory(const std::string& text) {
  const std::string written = config::formatTrajectory(config::parseTrajectory(text, kOrigin, {}));
  std::string again;
  try {
    again = config::formatTrajectory(config::parseTrajectory(written, "written", {}));
  } catch (const config::Error& error) {
    expect(false, "a written trajectory parses", written + error.what());
  }
  expect(again == written, "a trajectory is written as it was parsed", written + "\nagain:\n" + again);
}

void checkPath(const std::string& text) {
  const std::string written = config::formatPath(config::parsePath(text, kOrigin));
  std::string again;
  try {
    again = config::formatPath(config::parsePath(written, "written"));
  } catch (const config::Error& error) {
    expect(false, "a written path parses", written + error.what());
  }
  expect(again == written, "a path is written as it was parsed", written + "\nagain:\n" + again);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(fuzz::textOf(data, size));
  try {
    if (config::kindOfText(text, kOrigin) == "path")
      checkPath(text);
    else
      checkTrajectory(text);
  } catch (const config::Error& error) {
    fuzz::expectPlace(error.what(), kOrigin, text);
  }
  return 0;
}
