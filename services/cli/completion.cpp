// SPDX-License-Identifier: Apache-2.0
#include "services/cli/completion.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <ranges>
#include <sstream>

#include "config/config.h"
#include "config/file_tables.h"
#include "config/robot_files.h"
#include "services/cli/subcommand.h"
#include "services/cli/suggestion.h"

namespace tandem::cli {
namespace {

constexpr const char* kBash = R"(# Completion of tandem in bash and zsh.
[ -z "${ZSH_VERSION-}" ] || { autoload -U +X compinit && compinit -u; autoload -U +X bashcompinit && bashcompinit; }
_tandem() {
  local IFS=$'\n'
  COMPREPLY=($("${COMP_WORDS[0]}" __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
}
complete -o default -F _tandem tandem)";

std::vector<std::string> presetsOf(const std::vector<std::string>& kinds) {
  std::vector<std::string> names;
  for (const std::string& kind : kinds) {
    for (const std::filesystem::path& file : config::presets(kind))
      names.push_back(file.stem().string());
  }
  return names;
}

/// Values of an option or positional argument: those of its set, written as {a,b} in its type, or presets by its name.
std::vector<std::string> valuesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (const auto open = type.find('{'), close = type.find('}');
      open != std::string::npos && close != std::string::npos) {
    std::vector<std::string> values;
    std::istringstream list(type.substr(open + 1, close - open - 1));
    for (std::string value; std::getline(list, value, ',');)
      values.push_back(value);
    return values;
  }
  const std::string& name = option.get_single_name();
  if (name == "robot") {
    std::vector<std::string> kinds;
    for (const config::RobotFile& robot : config::robotFiles())
      kinds.push_back(robot.kind);
    return presetsOf(kinds);
  }
  if (name == "files" || name == "file")
    return presetsOf(config::kinds());
  if (name == "trajectory")
    return presetsOf({"trajectory", "path"});
  const bool kind = std::ranges::find(config::kinds(), name) != config::kinds().end();
  return kind ? presetsOf({name}) : std::vector<std::string>();
}

const CLI::Option* optionOf(const CLI::App* app, const std::string& word) {
  for (; app != nullptr; app = app->get_parent()) {
    if (const CLI::Option* option = app->get_option_no_throw(word))
      return option;
  }
  return nullptr;
}

}  // namespace

std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words) {
  const std::string begun = words.empty() ? "" : words.back();
  const CLI::App* part = &app;
  const CLI::Option* before = nullptr;  // with a value that is still to come
  std::size_t positionals = 0;
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    if (before != nullptr) {
      before = nullptr;
    } else if (words[i].starts_with("-")) {
      before = optionOf(part, words[i]);
      before = before != nullptr && before->get_type_size() > 0 ? before : nullptr;
    } else if (const std::vector<std::string> names = subcommandsOf(*part);
               std::ranges::find(names, words[i]) != names.end()) {
      part = part->get_subcommand(words[i]);
      positionals = 0;
    } else if (!names.empty()) {
      return {};  // no such subcommand
    } else {
      ++positionals;
    }
  }
  std::vector<std::string> found;
  if (before != nullptr) {
    found = valuesOf(*before);
  } else if (begun.starts_with("-")) {
    found = optionsOf(part);
  } else {
    found = subcommandsOf(*part);
    std::size_t place = 0;
    for (const CLI::Option* option : part->get_options([](const CLI::Option* o) { return o->get_positional(); })) {
      if (place++ == positionals || (place == positionals && option->get_items_expected_max() > 1))
        std::ranges::copy(valuesOf(*option), std::back_inserter(found));
    }
  }
  std::erase_if(found, [&](const std::string& word) { return !word.starts_with(begun); });
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

void registerCompletion(CLI::App& app, int& exit_code) {
  CLI::App* completion = app.add_subcommand("completion", "print the script that completes commands in bash and zsh");
  completion->footer(
      "In ~/.bashrc or ~/.zshrc:\n  eval \"$(tandem completion)\"\nThen Tab completes commands, options, values and "
      "presets.");
  completion->callback([&exit_code] {
    answer(kBash, {{"script", kBash}});
    exit_code = kOk;
  });
}

}  // namespace tandem::cli
