// SPDX-License-Identifier: Apache-2.0
/** @file tandem replay: publication of a recording over DDS. */
#include <chrono>
#include <iostream>
#include <map>
#include <memory>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "services/cli/recordings/recordings.h"
#include "services/cli/recordings/resimulation.h"
#include "services/cli/subcommand.h"
#include "services/client/role.h"
#include "services/recordings/hal_watch.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

struct ReplayCommand {
  std::string file, deployment = runtime::defaultDeployment();
  std::vector<std::string> topics{"*"}, remap;
  double rate = 1.0, start = 0.0, seconds = 0.0;
  bool loop = false, simulate = false;
};

using Clock = std::chrono::steady_clock;

constexpr double kListen = 1.0;  // s: enough to receive a running drive side
constexpr double kMatch = 0.5;   // s: for readers to match the writers

dds::Profile profileOf(const recording::Channel& channel) {
  const auto said = channel.metadata.find("profile");
  for (const auto profile : {dds::Profile::kPeriodic, dds::Profile::kCommand, dds::Profile::kLatched}) {
    if (said != channel.metadata.end() && said->second == dds::name(profile))
      return profile;
  }
  return dds::Profile::kReliable;
}

std::map<std::string, std::string> renamings(const ReplayCommand& options) {
  std::map<std::string, std::string> names;
  for (const std::string& rule : options.remap) {
    const auto split = rule.find(":=");
    if (split == std::string::npos || split == 0 || split + 2 == rule.size())
      throw Failure(kUsage, "--remap: found '" + rule + "', expected OLD:=NEW");
    names[rule.substr(0, split)] = rule.substr(split + 2);
  }
  return names;
}

/** The topics of a recording, with the names under which they are published. */
std::map<std::string, dds::TopicInfo> targets(const ReplayCommand& options,
                                              Recording& recording,
                                              const config::Robot& robot) {
  const recording::Selection selection = recording.select(options.topics);
  std::map<std::string, std::string> names = renamings(options);
  std::map<std::string, dds::TopicInfo> topics;
  const std::vector<dds::TopicInfo> known = dds::allTopics(config::armList(robot));
  for (const auto& [id, channel] : recording.reader().channels()) {
    const auto schema = recording.reader().schemas().find(channel.schema);
    if (!selection.channel(channel) || schema == recording.reader().schemas().end() || channel.encoding != "cdr")
      continue;
    const std::string old_name = recording.topicOf(channel);
    dds::TopicInfo topic{
        names.contains(old_name) ? names[old_name] : old_name, schema->second.name, profileOf(channel), "", "", ""};
    for (const dds::TopicInfo& other : known) {
      if (other.name == topic.name)
        topic = {other.name, topic.type, other.profile, "", other.publisher, ""};
    }
    recording.changes(channel);  // throws if its messages cannot be replayed
    topics.emplace(old_name, topic);
  }
  for (const auto& [old_name, name] : names) {
    if (!topics.contains(old_name))
      throw Failure(kUsage, "--remap: topic '" + old_name + "' is not in the recording, or not among --topics");
  }
  return topics;
}

/** Refuses, before and during the replay, to publish to a robot that could move. */
class Guard {
 public:
  Guard(dds::Bus& bus, const std::map<std::string, dds::TopicInfo>& topics) : watch_(bus) {
    for (const auto& [old_name, topic] : topics) {
      if (recordings::actedUpon(topic))
        acted_upon_ += (acted_upon_.empty() ? "" : ", ") + topic.name;
    }
  }
  void check() const {
    if (!acted_upon_.empty() && watch_.driveSource() == recordings::HalWatch::DriveSource::kHardware)
      throw Failure(kFailure, "refused: " + watch_.describe() + "; these topics would move a robot: " + acted_upon_ +
                                  ". Exclude them with --topics, or use another domain or prefix");
  }

 private:
  recordings::HalWatch watch_;
  std::string acted_upon_;
};

int play(const ReplayCommand& options, Recording& recording) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Robot robot = config::loadAnyRobot(deployment);
  const auto topics = targets(options, recording, robot);
  const recording::Selection selection = recording.select(options.topics, options.start, options.seconds);
  runtime::StopSignal stop;
  dds::Bus bus(runtime::ofAnyRobot(client::clientOptions(deployment)));
  const Guard guard(bus, topics);
  stop.waitFor(kListen);
  guard.check();
  std::map<std::string, std::unique_ptr<dds::RawWriter>> writers;
  for (const auto& [old_name, topic] : topics)
    writers.emplace(old_name, std::make_unique<dds::RawWriter>(bus, topic));
  stop.waitFor(kMatch);

  std::uint64_t played = 0, refused = 0;
  do {
    const std::uint64_t first = std::max(selection.from, recording.reader().statistics().start);
    const auto start = Clock::now();
    recording.reader().forEach(selection, [&](const recording::Channel& channel, const recording::Message& message) {
      const auto writer = writers.find(recording.topicOf(channel));
      if (writer == writers.end())
        return true;
      const double due = 1e-9 * static_cast<double>(message.log_time - first) / options.rate;
      const double wait = due - std::chrono::duration<double>(Clock::now() - start).count();
      if (wait > 0.0)
        stop.waitFor(wait);
      if (stop.requested())
        return false;
      guard.check();
      const std::optional<std::string> bytes = recording.today(channel, message.data);
      ++(bytes && writer->second->write(*bytes) ? played : refused);
      return true;
    });
  } while (options.loop && !stop.requested() && played > 0);
  answer("replayed " + std::to_string(played) + " messages of " + std::to_string(writers.size()) + " topics",
         {{"messages", played}, {"topics", writers.size()}, {"refused", refused}});
  if (refused > 0)
    std::cerr << refused << " messages were rejected by DDS, or do not fit their definition\n";
  return recording.reportDamage() || refused > 0 ? kFailure : kOk;
}

int runReplay(const ReplayCommand& options) {
  Recording recording(options.file);
  if (recording.reader().statistics().messages == 0)
    throw Failure(kUsage, options.file + ": contains no messages");
  return options.simulate ? resimulate(recording) : play(options, recording);
}

}  // namespace

void registerReplay(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplayCommand>();
  CLI::App* replay = app.add_subcommand("replay", "replay a recording over DDS, or through the simulator");
  replay->add_option("file", options->file, "MCAP file")->required();
  replay->add_option("-d,--deployment", options->deployment, "deployment file or preset: network and prefix")
      ->capture_default_str();
  replay->add_option("-r,--rate", options->rate, "speed factor")->check(client::kPositive)->capture_default_str();
  replay->add_option("--start", options->start, "start this many seconds after the first message")
      ->check(client::kNonNegative);
  replay->add_option("--for", options->seconds, "duration to replay, s of the recording (default: all)")
      ->check(client::kPositive);
  replay->add_option("-t,--topics", options->topics, "topics, without prefix; * matches any text")
      ->capture_default_str();
  replay->add_option("--remap", options->remap, "OLD:=NEW topics, without prefix");
  replay->add_flag("--loop", options->loop, "repeat until Ctrl-C");
  replay->add_flag(
      "--simulate", options->simulate,
      "feed the commands of a lock-step run to the simulator, with the recorded configuration, and compare "
      "its states with the recorded ones, sample by sample");
  replay->footer(
      "Topics that control a robot are refused while a HAL with hardware is present; a simulator does not prevent "
      "replay.\nExit code 1: refused, or --simulate found a difference.");
  replay->callback([options, &exit_code] { guarded(exit_code, [&] { return runReplay(*options); }); });
}

}  // namespace tandem::cli
