// SPDX-License-Identifier: Apache-2.0
/** @file Temporary folder, removed at the end of a command. */
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>

#include "services/cli/subcommand.h"

namespace tandem::cli {

/** A folder that exists as long as the object. */
class TemporaryFolder {
 public:
  /// @throw Failure if it cannot be created.
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw Failure(kFailure, name + ": cannot be created");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace tandem::cli
