// SPDX-License-Identifier: Apache-2.0
/** @file Logs of candump: every frame that is read is valid and is written back as the same frame; errors have a line.
 */
#include "hal/can/candump.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "tests/fuzz/harness.h"

using namespace tandem::hal::can;

namespace {

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(tandem::fuzz::textOf(data, size));
  std::istringstream stream(text);
  try {
    for (const LogEntry& entry : readLog(stream, "run.log")) {
      const std::string line = formatLogLine(entry.frame, entry.interface, entry.frame.time);
      tandem::fuzz::expect(lengthIsValid(entry.frame), "a frame has a valid length", line);
      const std::size_t hash = line.find('#', line.rfind(' '));
      const std::string id = line.substr(line.rfind(' ') + 1, hash - line.rfind(' '));
      tandem::fuzz::expect(upper(text).find(id) != std::string::npos, "an identifier is written as it was read", line);
      const LogEntry again = parseLogLine(line);
      tandem::fuzz::expect(sameOnWire(again.frame, entry.frame), "a frame is written as it was read", line);
      tandem::fuzz::expect(again.interface == entry.interface, "an interface is written as it was read", line);
      tandem::fuzz::expect(again.frame.time / 1000 == entry.frame.time / 1000, "a time is written as it was read",
                           line);
      tandem::fuzz::expect(entry.frame.remote || text.size() >= 2u * entry.frame.length, "data come from the text",
                           line);
    }
  } catch (const LogError& error) {
    tandem::fuzz::expectPlace(error.what(), "run.log", text);
  }
  return 0;
}
