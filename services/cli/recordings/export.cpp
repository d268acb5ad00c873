// SPDX-License-Identifier: Apache-2.0
/** @file tandem export and tandem plot: recordings as CSV, MATLAB and HDF5 files and as figures. */
#include "recording/export.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>

#include "config/robot_files.h"
#include "recording/named_columns.h"
#include "services/cli/models/figure.h"
#include "services/cli/recordings/recordings.h"
#include "services/cli/subcommand.h"
#include "services/runtime/temporary_folder.h"

namespace tandem::cli {
namespace {

struct ExportCommand {
  std::string file, csv, mat, hdf5, align;
  FigureOptions figures;
  std::vector<std::string> topics{"*"};
  double start = 0.0, seconds = 0.0, resample = 0.0;
  bool indices = false;
};

template <idl::Enumerated E>
std::vector<std::string> namesOf() {
  std::vector<std::string> names;
  for (const auto& entry : idl::Enumeration<E>::entries)
    names.emplace_back(entry.name);
  return names;
}

/// Items of a list with commas.
std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> items;
  std::istringstream stream(list);
  for (std::string item; std::getline(stream, item, ',');)
    items.push_back(item);
  return items;
}

/// Arms of the metadata, whose joints are not known: the first half translates.
std::vector<recording::ArrayNames::Arm> armsOfMetadata(const Recording& recording) {
  std::vector<recording::ArrayNames::Arm> arms;
  const std::vector<std::string> names = split(recording.about("arms")), joints = split(recording.about("joints"));
  for (std::size_t i = 0; i < names.size(); ++i) {
    recording::ArrayNames::Arm& arm = arms.emplace_back(recording::ArrayNames::Arm{names[i], {}});
    const int count = i < joints.size() ? std::atoi(joints[i].c_str()) : 0;
    for (int joint = 0; joint < std::min(count, safety::kMaxJointsPerArm); ++joint)
      arm.joints.push_back({"joint_" + std::to_string(joint + 1), joint >= count / 2});
  }
  return arms;
}

/// Names of the recorded robot; no arms if the file is not one of Tandem's.
recording::ArrayNames arrayNames(Recording& recording) {
  recording::ArrayNames names{armsOfMetadata(recording), namesOf<idl::Action>(), {}};
  names.prefixes = {{"guard_", namesOf<idl::Guard>()}, {"hardware_", namesOf<idl::HardwareGuard>()}};
  if (names.arms.empty())
    return names;
  try {
    const runtime::TemporaryFolder folder;
    std::ofstream(folder.path() / "robot.yaml") << recording.attachment("robot.yaml");
    std::vector<recording::ArrayNames::Arm> arms;
    for (const config::Arm& arm : config::loadAnyRobot(folder.path() / "robot.yaml").arms) {
      arms.push_back({arm.name, {}});
      for (int joint = 0; joint < arm.jointCount(); ++joint)
        arms.back().joints.push_back(
            {arm.joint_names[static_cast<std::size_t>(joint)], !arm.limits.isTranslation(joint)});
    }
    names.arms = std::move(arms);
  } catch (const std::exception& error) {
    std::cerr << "the names of the joints are not known, they are called joint_1, joint_2, ...: " << error.what()
              << "\n";
  }
  return names;
}

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
    std::string topics;
    for (const recording::Table& table : tables)
      topics += (topics.empty() ? "" : ", ") + table.topic;
    throw Failure(kUsage, "--align: found '" + options.align + "', expected an exported topic: " + topics);
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
  if (!options.indices) {
    const recording::ArrayNames names = arrayNames(recording);
    if (!names.arms.empty())
      recording::nameColumns(names, set.tables);
  }
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
  std::string text;
  nlohmann::ordered_json rows = nlohmann::ordered_json::object();
  for (const recording::Table& table : set.tables) {
    text += (text.empty() ? "" : "\n") + table.topic + ": " + std::to_string(table.rows()) + " rows";
    rows[table.topic] = table.rows();
  }
  nlohmann::ordered_json fields{{"rows", rows}};
  if (set.aligned) {
    text += fmt::format("\naligned: {} rows, {} columns", set.aligned->times.size(), set.aligned->names.size());
    fields["aligned"] = {{"rows", set.aligned->times.size()}, {"columns", set.aligned->names.size()}};
  }
  answer(text, fields);
  return recording.reportDamage() ? kFailure : kOk;
}

int runPlot(const ExportCommand& options) {
  Recording recording(options.file);
  const recording::ExportSet set = collect(options, recording);
  const runtime::TemporaryFolder folder;
  recording::exportCsv(set, folder.path());
  drawFigures("recording_figures.py",
              {folder.path().string(), options.figures.path, "--format", options.figures.format, "--arms",
               recording.about("arms"), "--joints", recording.about("joints")},
              options.figures);
  if (client::asJson())
    answer("", {{"figures", options.figures.path}});
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
  command->add_flag("--indices", options->indices,
                    "arrays as on the wire, with all their elements: position[9] in CSV, matrices in MATLAB and HDF5");
  command->footer("SI units throughout; docs/recording.md has recipes for Python, MATLAB and spreadsheets.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runExport(*options); }); });
}

void registerPlot(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportCommand>();
  options->indices = true;
  CLI::App* command = app.add_subcommand("plot", "draw the standard figures of a recording");
  command->add_option("file", options->file, "MCAP file")->required();
  addFiguresOption(*command, options->figures, "folder for the figures")->required();
  command->add_option("--start", options->start, "skip this many seconds at the beginning")
      ->check(client::kNonNegative);
  command->add_option("--for", options->seconds, "duration, s (default: all)")->check(client::kPositive);
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runPlot(*options); }); });
}

}  // namespace tandem::cli
