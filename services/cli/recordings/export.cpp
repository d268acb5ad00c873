// SPDX-License-Identifier: Apache-2.0
/** @file tandem export and tandem plot: recordings as CSV, MATLAB and HDF5 files and as figures. */
#include "recording/export.h"

#include <cmath>
#include <iostream>

#include "services/cli/models/figure.h"
#include "services/cli/recordings/recordings.h"
#include "services/cli/temporary_folder.h"

namespace tandem::cli {
namespace {

struct ExportCommand {
  std::string file, csv, mat, hdf5, align;
  FigureOptions figures;
  std::vector<std::string> topics{"*"};
  double start = 0.0, seconds = 0.0, resample = 0.0;
};

/// Times of the aligned table: those of a topic, or a grid.
std::vector<std::uint64_t> alignedTimes(const ExportCommand& options,
                                        const std::vector<recording::Table>& tables,
                                        std::uint64_t start,
                                        std::uint64_t end) {
  if (!options.align.empty()) {
    for (const recording::Table& table : tables) {
      if (table.topic == options.align)
        return table.log_times;
    }
    throw Failure(kUsage, "--align: topic '" + options.align + "' is not in the recording, or not among --topics");
  }
  std::vector<std::uint64_t> times;
  const double step = 1e9 / options.resample;
  for (double at = 0.0; static_cast<double>(start) + at <= static_cast<double>(end); at += step)
    times.push_back(start + static_cast<std::uint64_t>(std::llround(at)));
  return times;
}

recording::ExportSet collect(const ExportCommand& options, Recording& recording) {
  recording::ExportSet set;
  const recording::Selection selection = recording.select(options.topics, options.start, options.seconds);
  set.tables = recording.tables(selection);
  const recording::Statistics& statistics = recording.reader().statistics();
  set.start = statistics.messages == 0 ? 0 : statistics.start;
  if (!options.align.empty() || options.resample > 0.0) {
    const std::uint64_t from = std::max(selection.from, set.start), to = std::min(selection.to, statistics.end);
    set.aligned = recording::align(set.tables, alignedTimes(options, set.tables, from, to));
  }
  for (const recording::Metadata& metadata : recording.reader().metadata()) {
    for (const auto& [key, value] : metadata.values)
      set.about[metadata.name + "." + key] = value;
  }
  return set;
}

int runExport(const ExportCommand& options) {
  if (options.csv.empty() && options.mat.empty() && options.hdf5.empty())
    throw Failure(kUsage, "expected at least one of --csv, --mat and --hdf5");
  Recording recording(options.file);
  const recording::ExportSet set = collect(options, recording);
  try {
    if (!options.csv.empty())
      recording::exportCsv(set, options.csv);
    if (!options.mat.empty())
      recording::exportMat(set, options.mat);
    if (!options.hdf5.empty())
      recording::exportHdf5(set, options.hdf5);
  } catch (const std::runtime_error& error) {
    throw Failure(kFailure, error.what());
  }
  for (const recording::Table& table : set.tables)
    std::cout << table.topic << ": " << table.rows() << " rows\n";
  if (set.aligned)
    std::cout << "aligned: " << set.aligned->times.size() << " rows, " << set.aligned->names.size() << " columns\n";
  return recording.reportDamage() ? kFailure : kOk;
}

int runPlot(const ExportCommand& options) {
  Recording recording(options.file);
  const recording::ExportSet set = collect(options, recording);
  const TemporaryFolder folder;
  recording::exportCsv(set, folder.path());
  drawFigures("recording_figures.py",
              {folder.path().string(), options.figures.path, "--format", options.figures.format, "--arms",
               recording.about("arms"), "--joints", recording.about("joints")},
              options.figures);
  return recording.reportDamage() ? kFailure : kOk;
}

}  // namespace

void registerExport(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportCommand>();
  CLI::App* command = app.add_subcommand("export", "convert a recording to CSV, MATLAB or HDF5 files");
  command->add_option("file", options->file, "MCAP file")->required();
  command->add_option("--csv", options->csv, "folder for one file per topic");
  command->add_option("--mat", options->mat, "MATLAB file with one struct per topic");
  command->add_option("--hdf5", options->hdf5, "HDF5 file with one group per topic");
  command->add_option("-t,--topics", options->topics, "topics, without prefix; * matches any text")
      ->capture_default_str();
  command->add_option("--start", options->start, "skip this many seconds at the beginning")
      ->check(client::kNonNegative);
  command->add_option("--for", options->seconds, "duration, s (default: all)")->check(client::kPositive);
  CLI::Option* resample =
      command
          ->add_option("--resample", options->resample, "additional table with all topics resampled at this rate, Hz")
          ->check(client::kPositive);
  command->add_option("--align", options->align, "additional table with all topics at the times of this topic")
      ->excludes(resample);
  command->footer("SI units throughout; docs/recording.md has recipes for Python, MATLAB and spreadsheets.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runExport(*options); }); });
}

void registerPlot(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportCommand>();
  CLI::App* command = app.add_subcommand("plot", "draw the standard figures of a recording");
  command->add_option("file", options->file, "MCAP file")->required();
  addFiguresOption(*command, options->figures, "folder for the figures")->required();
  command->add_option("--start", options->start, "skip this many seconds at the beginning")
      ->check(client::kNonNegative);
  command->add_option("--for", options->seconds, "duration, s (default: all)")->check(client::kPositive);
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runPlot(*options); }); });
}

}  // namespace tandem::cli
