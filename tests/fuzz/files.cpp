// SPDX-License-Identifier: Apache-2.0
/** @file YAML files of every kind: each loads, with limits and numbers that are finite, or is refused at a place inside
 * the file. */
#include <cmath>
#include <filesystem>
#include <fstream>

#include "config/config.h"
#include "tests/fuzz/harness.h"

using namespace tandem;
using fuzz::expect;

namespace {

namespace fs = std::filesystem;

/** A folder with all presets, and in it a file of the input: what files refer to is found. */
class Folder {
 public:
  Folder() {
    fs::copy(fs::path(TANDEM_SOURCE) / "config/presets", folder_.path(), fs::copy_options::recursive);
    setenv("TANDEM_CONFIG_PATH", folder_.path().c_str(), 1);
    fs::create_directory(folder_.path() / "inputs");
  }

  fs::path write(std::string_view text) const {
    const fs::path file = folder_.path() / "inputs" / "input.yaml";
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

 private:
  fuzz::TemporaryFolder folder_;
};

void checkRobot(const config::Robot& robot) {
  for (const config::Arm& arm : robot.arms) {
    expect(arm.home.allFinite(), "a home position is finite", arm.name);
    expect(static_cast<int>(arm.joint_names.size()) == arm.jointCount() && arm.home.size() == arm.jointCount(),
           "an arm has a name and a home position per joint", arm.name);
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const std::string_view text = fuzz::textOf(data, size);
  const fs::path file = folder.write(text);
  try {
    const config::Summary summary = config::validate(file);
    expect(!summary.text.empty(), "a file that loads is described");
    if (summary.kind == "robot")
      checkRobot(config::loadRobot(file));
  } catch (const config::Error& error) {
    // The name of a file that it refers to may be another one.
    if (error.file() == file.string())
      fuzz::expectPlace(error.what(), file.string(), text);
    else
      expect(!error.file().empty(), "an error names a file", error.what());
  }
  return 0;
}
