// SPDX-License-Identifier: Apache-2.0
/** @file Figures from CSV files, drawn by a Python script. */
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tandem::cli {

/** Destination, size and type of figures. */
struct FigureOptions {
  std::string path;  ///< one file that ends in .png, .pdf or .svg, or a folder; empty: no figures
  std::string format = "png";
  int columns = 2;  ///< of a page: 88 or 180 mm
  int dpi = 200;

  bool wanted() const { return !path.empty(); }
};

/// --figure FILE, --width and --dpi. @return the first of them
CLI::Option* addFigureOption(CLI::App& command, FigureOptions& options, const std::string& description);

/// --figures FOLDER, --format, --width and --dpi. @return the first of them
CLI::Option* addFiguresOption(CLI::App& command, FigureOptions& options, const std::string& description);

/// Runs experiments/SCRIPT with arguments and the options but the path; what it prints goes to stderr, as stdout may be
/// JSON.
/// @throw Failure where it fails.
void drawFigures(const std::string& script, std::vector<std::string> arguments, const FigureOptions& options);

}  // namespace tandem::cli
