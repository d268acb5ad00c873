// SPDX-License-Identifier: Apache-2.0
#include "services/cli/deployment/sibling.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "services/cli/subcommand.h"

namespace tandem::cli {

void become(const std::string& program, const std::vector<std::string>& words) {
  const auto path = std::filesystem::read_symlink("/proc/self/exe").parent_path() / program;
  std::vector<std::string> all{path.string()};
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> arguments;
  for (std::string& word : all)
    arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  throw Failure(kFailure, path.string() + ": " + std::strerror(errno));
}

}  // namespace tandem::cli
