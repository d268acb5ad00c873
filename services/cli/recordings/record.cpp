// SPDX-License-Identifier: Apache-2.0
/** @file tandem record: records topics of a running robot to an MCAP file. */
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "services/cli/subcommand.h"
#include "services/client/role.h"
#include "services/recordings/capture.h"
#include "services/recordings/recorder.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

struct RecordCommand {
  std::string deployment = runtime::defaultDeployment(), output;
  std::vector<std::string> topics{"*"};
  double seconds = 0.0, split_megabytes = 0.0, split_seconds = 0.0, memory_megabytes = 64.0;
  bool json = false;
};

using Clock = std::chrono::steady_clock;

void reportRecording(const RecordCommand& options,
                     const char* event,
                     const recordings::Recorder::Totals& totals,
                     double seconds) {
  if (options.json) {
    nlohmann::ordered_json files = nlohmann::ordered_json::array();
    for (const auto& file : totals.files)
      files.push_back(file.string());
    std::cout << nlohmann::ordered_json{{"event", event},
                                        {"seconds", seconds},
                                        {"messages", totals.messages},
                                        {"lost", totals.lost},
                                        {"overwritten", totals.overwritten},
                                        {"bytes", totals.bytes},
                                        {"files", files}}
              << std::endl;
    return;
  }
  std::cout << event << " " << totals.files.back().string() << ": " << static_cast<int>(seconds) << " s, "
            << totals.messages << " messages, " << totals.lost << " lost, " << totals.bytes / 1000 << " kB"
            << std::endl;
}

int runRecord(const RecordCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Robot robot = config::loadAnyRobot(deployment);
  const std::vector<dds::TopicInfo> topics =
      recordings::chooseTopics(dds::allTopics(config::armList(robot)), options.topics);
  const recordings::RunInfo info = recordings::describeRun(deployment, robot);
  recordings::RecorderOptions recorder_options;
  recorder_options.file = options.output.empty()
                              ? recordings::timeName(recordings::wallClock()) + "_" + deployment.name + ".mcap"
                              : options.output;
  recorder_options.largest_file = static_cast<std::uint64_t>(1e6 * options.split_megabytes);
  recorder_options.longest_file = options.split_seconds;
  recorder_options.memory = static_cast<std::size_t>(1e6 * options.memory_megabytes);

  runtime::StopSignal stop;
  recordings::Recorder recorder(info, deployment.prefix, topics, recorder_options);
  const auto start = Clock::now();
  try {
    dds::Bus bus(runtime::ofAnyRobot(client::clientOptions(deployment)));
    const recordings::Capture capture(bus, topics,
                                      [&](const auto& tag, std::string_view bytes) { recorder.take(tag, bytes); });
    reportRecording(options, "recording", recorder.totals(), 0.0);
    double reported = 0.0;
    while (!stop.waitFor(0.02) && (options.seconds <= 0.0 || since(start) < options.seconds)) {
      recorder.drain();
      if (const double now = since(start); now - reported >= 1.0) {
        reportRecording(options, "recording", recorder.totals(), now);
        reported = now;
      }
    }
    recorder.drain();
  } catch (const std::system_error& error) {
    reportRecording(options, "failed", recorder.totals(), since(start));
    throw Failure(kFailure, std::string(error.what()) + "; the part written before is complete");
  }
  recorder.close();
  reportRecording(options, "recorded", recorder.totals(), since(start));
  if (recorder.totals().messages == 0)
    throw Failure(kFailure, "no message received (domain " + std::to_string(deployment.domain) + ", prefix " +
                                deployment.prefix + "); check that `tandem up` is running");
  return recorder.totals().lost == 0 ? kOk : kFailure;
}

}  // namespace

void registerRecord(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RecordCommand>();
  CLI::App* record = app.add_subcommand("record", "record the topics of a running robot to an MCAP file");
  record->add_option("deployment,-d,--deployment", options->deployment, "deployment file or preset")
      ->capture_default_str();
  record->add_option("-o,--output", options->output, "file (default: time and name of the deployment, .mcap)");
  record->add_option("-t,--topics", options->topics, "topics, without prefix; * matches any text")
      ->capture_default_str();
  record->add_option("--for", options->seconds, "stop after this many seconds")->check(client::kPositive);
  record->add_option("--split-mb", options->split_megabytes, "start a new file after this many megabytes")
      ->check(client::kPositive);
  record->add_option("--split-s", options->split_seconds, "start a new file after this many seconds")
      ->check(client::kPositive);
  record->add_option("--memory-mb", options->memory_megabytes, "memory buffer for a slow disk, MB")
      ->check(client::kPositive)
      ->capture_default_str();
  record->add_flag("--json", options->json, "one JSON object per line");
  record->footer(
      "Ctrl-C ends the recording. Exit code 1: samples were lost (gaps in the writers' sequence numbers), or the\n"
      "disk is full; the file is complete up to there. After a `kill -9` it is readable up to the last second.");
  record->callback([options, &exit_code] { guarded(exit_code, [&] { return runRecord(*options); }); });
}

}  // namespace tandem::cli
