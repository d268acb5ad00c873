// SPDX-License-Identifier: Apache-2.0
#include "services/cli/suggestion.h"

#include <algorithm>

#include "config/key_table.h"
#include "config/suggestion.h"

namespace tandem::cli {
namespace {

bool has(const std::vector<std::string>& names, const std::string& word) {
  return std::find(names.begin(), names.end(), word) != names.end();
}

std::string ask(const std::string& word) { return word.empty() ? "" : "Did you mean `" + word + "`?"; }

/// The nearest known word, or all of them if none is similar.
std::string meantOrKnown(const std::string& word, const std::vector<std::string>& known) {
  const std::string nearest = config::nearestWord(word, known);
  return nearest.empty() ? "Found `" + word + "`, expected one of: " + config::join(known) : ask(nearest);
}

}  // namespace

std::vector<std::string> subcommandsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* part : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(part->get_name());
  return names;
}

std::vector<std::string> optionsOf(const CLI::App* app) {
  std::vector<std::string> names;
  for (; app; app = app->get_parent()) {
    for (const CLI::Option* option : app->get_options()) {
      for (const std::string& name : option->get_lnames())
        names.push_back("--" + name);
    }
  }
  return names;
}

std::string suggestion(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* part = &app;
  bool value = false;  // the word may be the value of the option before it
  for (const std::string& word : words) {
    if (word == "--")
      break;
    if (word.starts_with("--")) {
      const std::vector<std::string> options = optionsOf(part);
      const std::string name = word.substr(0, word.find('='));
      if (!has(options, name))
        return ask(config::nearestWord(name, options));
      value = name == word;
      continue;
    }
    const std::vector<std::string> subcommands = subcommandsOf(*part);
    if (has(subcommands, word))
      part = part->get_subcommand(word);
    else if (!value && !word.starts_with("-") && !subcommands.empty())
      return meantOrKnown(word, subcommands);
    value = word.starts_with("-");
  }
  return {};
}

}  // namespace tandem::cli
