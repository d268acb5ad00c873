// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/figure.h"

#include <sys/wait.h>
#include <unistd.h>

#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

void addSizeOptions(CLI::App& command, FigureOptions& options) {
  command.add_option("--width", options.columns, "width of a figure in columns of a page: 1 (88 mm) or 2 (180 mm)")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  command.add_option("--dpi", options.dpi, "resolution of a PNG file, and of images in PDF and SVG")
      ->check(CLI::Range(30, 2400))
      ->capture_default_str();
}

std::string checkEnding(const std::string& path) {
  for (const char* ending : {".png", ".pdf", ".svg"}) {
    if (path.ends_with(ending))
      return {};
  }
  return "found '" + path + "', expected a file that ends in .png, .pdf or .svg";
}

/// Runs Debian's Python; what it prints goes to stderr. @return whether it ended with 0
bool runPython(const std::vector<std::string>& arguments) {
  std::vector<const char*> command{"python3"};
  for (const std::string& argument : arguments)
    command.push_back(argument.c_str());
  command.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(STDERR_FILENO, STDOUT_FILENO);
    execv("/usr/bin/python3", const_cast<char* const*>(command.data()));
    _exit(127);
  }
  int status = 0;
  return pid > 0 && waitpid(pid, &status, 0) == pid && status == 0;
}

}  // namespace

CLI::Option* addFigureOption(CLI::App& command, FigureOptions& options, const std::string& description) {
  CLI::Option* option = command.add_option("--figure", options.path, description + " (PNG, PDF or SVG by its ending)")
                            ->check(CLI::Validator(checkEnding, "FILE"));
  addSizeOptions(command, options);
  return option;
}

CLI::Option* addFiguresOption(CLI::App& command, FigureOptions& options, const std::string& description) {
  CLI::Option* option = command.add_option("--figures", options.path, description);
  command.add_option("--format", options.format, "file type of the figures")
      ->check(CLI::IsMember({"png", "pdf", "svg"}))
      ->capture_default_str();
  addSizeOptions(command, options);
  return option;
}

void drawFigures(const std::string& script, std::vector<std::string> arguments, const FigureOptions& options) {
  for (const std::string& argument :
       {std::string("--width"), std::to_string(options.columns), std::string("--dpi"), std::to_string(options.dpi)})
    arguments.push_back(argument);
  arguments.insert(arguments.begin(), shareFile("experiments/" + script));
  if (runPython(arguments))
    return;
  if (!runPython({"-c", "import importlib.util as i; exit(not (i.find_spec('matplotlib') and i.find_spec('numpy')))"}))
    throw Failure(
        kFailure,
        "figures need python3-matplotlib and python3-numpy, which are not found: deploy/run.sh --with figures");
  throw Failure(kFailure, "the figures could not be drawn, for the reason above");
}

}  // namespace tandem::cli
