// SPDX-License-Identifier: Apache-2.0
/** @file tandem new: first version of a file, from a preset, with all keys that it does not use as comments. */
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>

#include "config/config.h"
#include "config/file_tables.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

struct NewCommand {
  std::string kind, name, from, robot, output;
  int arms = 2;
};

/// The preset that a file begins as.
std::string presetOf(const NewCommand& options) {
  if (!options.from.empty())
    return options.from;
  const bool one = options.arms == 1;
  if (options.kind == "robot")
    return one ? "timc2024" : "ark2024";
  if (options.kind == "experiment")
    return one ? "one-arm" : "table3";
  if (options.kind == "trajectory")
    return one ? "circle-one-arm" : "circle";
  return one ? "one-arm" : "laptop";
}

std::string keyOf(const std::string& line) {
  return line.empty() || line[0] == ' ' || line[0] == '#' ? "" : line.substr(0, line.find(':'));
}

/// A preset's lines from its first key on, with the new name, and with presets by name where it has paths to them.
std::vector<std::string> linesOf(const std::filesystem::path& file, const NewCommand& options) {
  std::ifstream stream(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    const std::string key = keyOf(line);
    if (lines.empty() && key != "tandem")
      continue;
    if (key == "name")
      line = "name: \"" + options.name + '"';  // it may look like a number
    else if (key == "robot")
      line =
          "robot: " + (options.robot.empty() ? std::filesystem::path(line.substr(6)).stem().string() : options.robot);
    lines.push_back(line);
  }
  return lines;
}

/// The keys of a kind that the lines do not have, as comments.
std::string otherKeys(const config::Mapping& table, const std::vector<std::string>& lines) {
  std::string text;
  for (const config::Field& field : table.fields) {
    const auto names = field.keys();
    const bool used = std::ranges::any_of(lines, [&](const std::string& line) {
      return std::ranges::any_of(names, [&](const auto& name) { return keyOf(line) == name.first; });
    });
    if (!used)
      text += "# " + field.key() + ":  # " + field.description + "; default: " + config::defaultText(field) + "\n";
  }
  return text.empty() ? "" : "\n# Further keys:\n" + text;
}

std::string textOf(const NewCommand& options) {
  const std::filesystem::path preset = config::findFile(presetOf(options), options.kind);
  const config::Mapping& table = config::tableOf(options.kind);
  const std::vector<std::string> lines = linesOf(preset, options);
  const std::filesystem::path schema =
      (preset.parent_path().parent_path() / "schemas" / (options.kind + ".schema.json")).lexically_normal();
  std::string text = "# " + table.description + "\n";
  if (std::filesystem::exists(schema))  // presets in a folder of the user's have none
    text += "# yaml-language-server: $schema=" + schema.string() + "\n";
  text += "# It began as the preset " + preset.stem().string() + ". All keys: docs/configuration/" + options.kind +
          ".md. After each change: tandem validate FILE\n";
  for (const std::string& line : lines)
    text += line + '\n';
  return text + otherKeys(table, lines);
}

/// The command that uses the file.
std::string nextStep(const NewCommand& options, const std::string& file) {
  if (options.kind == "robot")
    return "tandem fk --robot " + file + "; tandem new deployment NAME --robot " + file;
  if (options.kind == "experiment")
    return "tandem experiment " + file + " --offline";
  if (options.kind == "trajectory")
    return "tandem plan check " + file + (options.arms == 1 ? " --robot timc2024" : "");
  return "tandem up " + file;
}

int runNew(const NewCommand& options) {
  const std::string file = options.output.empty() ? options.name + ".yaml" : options.output;
  if (file != "-" && std::filesystem::exists(file))
    throw Failure(kUsage, file + ": found a file of this name, expected none; choose another name, or --output");
  const std::string text = textOf(options);
  if (file == "-") {
    answer(text.substr(0, text.find_last_not_of('\n') + 1), {{"text", text}});
    return kOk;
  }
  std::ofstream stream(file);
  if (!(stream << text << std::flush))
    client::failToWrite(kFailure, file);
  const std::string summary = config::validate(file).text;
  answer(file + ": " + summary + "\nedit it, then: tandem validate " + file + "; " + nextStep(options, file),
         {{"file", file}, {"kind", options.kind}, {"summary", summary}});
  return kOk;
}

}  // namespace

void registerNew(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<NewCommand>();
  const CLI::Validator name(
      [](const std::string& text) {
        const bool good = !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
          return std::isalnum(c) != 0 || c == '-' || c == '_';
        });
        return good ? "" : "found '" + text + "', expected letters, digits, - and _";
      },
      "");
  CLI::App* command =
      app.add_subcommand("new", "write a first version of a robot, trajectory, experiment or deployment file");
  command->add_option("kind", options->kind, "kind of file")
      ->required()
      ->check(CLI::IsMember({"robot", "trajectory", "experiment", "deployment"}));
  command->add_option("name", options->name, "its name: letters, digits, - and _")->required()->check(name);
  command->add_option("--arms", options->arms, "1: begin as a preset with one arm")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  command->add_option("--from", options->from, "begin as this preset or file instead");
  command->add_option("-r,--robot", options->robot, "experiment, deployment: robot file, or the name of a preset");
  command->add_option("-o,--output", options->output, "file (default: NAME.yaml); - is standard output");
  command->footer(
      "The file is valid as it is written. Keys that it does not use follow as comments, with their defaults.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runNew(*options); }); });
}

}  // namespace tandem::cli
