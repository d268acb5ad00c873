// SPDX-License-Identifier: Apache-2.0
/** @file tandem presets: the installed configuration files, by kind. */
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/config.h"
#include "config/file_tables.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

/// The first line of comment of a file after those for programs: license, schema for editors.
std::string description(const std::filesystem::path& file) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line) && line.starts_with("#");) {
    if (line.find("SPDX-") == std::string::npos && line.find("yaml-language-server:") == std::string::npos)
      return line.substr(std::min(line.size(), line.find_first_not_of("# ")));
  }
  return {};
}

nlohmann::ordered_json presetsJson(const std::string& kind) {
  nlohmann::ordered_json found = nlohmann::ordered_json::array();
  for (const std::string& each : config::kinds()) {
    if (!kind.empty() && kind != each)
      continue;
    for (const std::filesystem::path& file : config::presets(each))
      found.push_back({{"kind", each},
                       {"name", file.stem().string()},
                       {"file", file.string()},
                       {"description", description(file)}});
  }
  return found;
}

void print(const nlohmann::ordered_json& presets) {
  std::string kind;
  for (const auto& preset : presets) {
    if (preset["kind"] != kind) {
      kind = preset["kind"];
      std::cout << kind << ":\n";
    }
    std::cout << "  " << std::left << std::setw(26) << std::string(preset["name"]) << ' '
              << std::string(preset["description"]) << '\n';
  }
}

}  // namespace

void registerPresets(CLI::App& app, int& exit_code) {
  auto kind = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* presets = app.add_subcommand("presets", "list the presets: files that every command takes by name");
  presets->add_option("kind", *kind, "only this kind of file")->check(CLI::IsMember(config::kinds()));
  presets->add_flag("--json", *json, "as JSON, with the path of each file");
  presets->footer("Copy a preset as the first version of your own file; `tandem presets --json` prints the paths.");
  presets->callback([kind, json, &exit_code] {
    guarded(exit_code, [&] {
      const nlohmann::ordered_json found = presetsJson(*kind);
      if (*json)
        std::cout << found.dump(2) << '\n';
      else
        print(found);
      return kOk;
    });
  });
}

}  // namespace tandem::cli
