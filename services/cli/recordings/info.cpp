// SPDX-License-Identifier: Apache-2.0
/** @file tandem info: contents of a recording. */
#include <algorithm>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "recording/gaps.h"
#include "services/cli/recordings/recordings.h"
#include "services/cli/subcommand.h"
#include "services/recordings/run_file.h"

namespace tandem::cli {
namespace {

struct InfoCommand {
  std::string file, attachment;
  bool json = false, check = false;
};

/** One topic, all its writers together. */
struct TopicReport {
  std::string type;
  std::string changes;  ///< of the type since the recording
  std::set<std::uint16_t> writers;
  std::uint64_t messages = 0, lost = 0, bytes = 0;
  std::uint64_t first = 0, last = 0;  ///< ns since the epoch
  double longest_pause = 0.0;         ///< s

  double rate() const {
    return last > first ? 1e9 * static_cast<double>(messages - 1) / static_cast<double>(last - first) : 0.0;
  }
};

std::string changesOf(Recording& recording, const recording::Channel& channel) {
  try {
    return recording.changes(channel);
  } catch (const Failure& failure) {
    return failure.what();
  }
}

std::map<std::string, TopicReport> examine(Recording& recording) {
  std::map<std::string, TopicReport> topics;
  recording::GapCounter<std::uint16_t> gaps;
  recording.reader().forEach({}, [&](const recording::Channel& channel, const recording::Message& message) {
    TopicReport& topic = topics[recording.topicOf(channel)];
    if (topic.messages++ == 0)
      topic.first = message.log_time;
    else
      topic.longest_pause = std::max(topic.longest_pause, 1e-9 * static_cast<double>(message.log_time - topic.last));
    topic.last = message.log_time;
    topic.bytes += message.data.size();
    if (topic.writers.insert(channel.id).second && topic.changes.empty())
      topic.changes = changesOf(recording, channel);
    const auto schema = recording.reader().schemas().find(channel.schema);
    topic.type = schema == recording.reader().schemas().end() ? "" : schema->second.name;
    // Only recordings of this project number the samples per writer.
    if (channel.metadata.contains("writer"))
      gaps.see(channel.id, message.sequence);
    return true;
  });
  for (auto& [name, topic] : topics) {
    for (std::uint16_t writer : topic.writers)
      topic.lost += gaps.lost(writer);
  }
  return topics;
}

nlohmann::ordered_json infoJson(Recording& recording, const std::map<std::string, TopicReport>& topics) {
  recording::Reader& reader = recording.reader();
  nlohmann::ordered_json json{{"file", reader.file().string()},
                              {"profile", reader.profile()},
                              {"library", reader.library()},
                              {"finished", reader.finished()},
                              {"damage", reader.damage()},
                              {"messages", reader.statistics().messages},
                              {"start_ns", reader.statistics().messages == 0 ? 0 : reader.statistics().start},
                              {"duration_s", reader.statistics().duration()},
                              {"metadata", nlohmann::ordered_json::object()},
                              {"attachments", nlohmann::ordered_json::array()},
                              {"topics", nlohmann::ordered_json::object()}};
  for (const recording::Metadata& metadata : reader.metadata())
    json["metadata"][metadata.name] = metadata.values;
  for (std::size_t i = 0; i < reader.attachments().size(); ++i)
    json["attachments"].push_back({{"name", reader.attachments()[i].name},
                                   {"media_type", reader.attachments()[i].media_type},
                                   {"bytes", reader.attachmentData(i).size()}});
  for (const auto& [name, topic] : topics)
    json["topics"][name] = {{"type", topic.type},      {"messages", topic.messages},
                            {"rate_hz", topic.rate()}, {"writers", topic.writers.size()},
                            {"lost", topic.lost},      {"longest_pause_s", topic.longest_pause},
                            {"bytes", topic.bytes},    {"changes", topic.changes}};
  return json;
}

void printInfo(const nlohmann::ordered_json& json) {
  const double duration = json["duration_s"];
  std::cout << json["file"].get<std::string>() << ": "
            << (json["finished"] ? "finished" : "not finished: read up to the last whole chunk") << "\n"
            << json["messages"] << " messages in " << std::fixed << std::setprecision(1) << duration << " s, profile "
            << json["profile"].get<std::string>() << ", written by " << json["library"].get<std::string>() << "\n";
  if (json["messages"] != 0)
    std::cout << "from " << recordings::timeName(json["start_ns"].get<std::uint64_t>()) << " on\n";
  for (const auto& [name, values] : json["metadata"].items()) {
    std::cout << "\n" << name << ":\n";
    for (const auto& [key, value] : values.items())
      std::cout << "  " << key << ": " << value.get<std::string>() << "\n";
  }
  std::cout << "\nattachments (--attachment NAME prints one):\n";
  for (const auto& attachment : json["attachments"])
    std::cout << "  " << attachment["name"].get<std::string>() << ", " << attachment["bytes"] << " bytes\n";
  std::cout << "\n"
            << std::left << std::setw(28) << "topic" << std::right << std::setw(10) << "messages" << std::setw(9)
            << "Hz" << std::setw(9) << "writers" << std::setw(8) << "lost" << std::setw(10) << "pause/s"
            << "  type\n";
  for (const auto& [name, topic] : json["topics"].items())
    std::cout << std::left << std::setw(28) << name << std::right << std::setw(10)
              << topic["messages"].get<std::uint64_t>() << std::setw(9) << topic["rate_hz"].get<double>()
              << std::setw(9) << topic["writers"].get<std::uint64_t>() << std::setw(8)
              << topic["lost"].get<std::uint64_t>() << std::setw(10) << std::setprecision(3)
              << topic["longest_pause_s"].get<double>() << std::setprecision(1) << "  "
              << topic["type"].get<std::string>() << "\n";
  for (const auto& [name, topic] : json["topics"].items()) {
    if (topic["changes"] != "")
      std::cout << name << ": " << topic["changes"].get<std::string>() << "\n";
  }
}

int runInfo(const InfoCommand& options) {
  Recording recording(options.file, options.check ? recording::Reader::Open::kScan : recording::Reader::Open::kFast);
  if (!options.attachment.empty()) {
    std::cout << recording.attachment(options.attachment);
    return kOk;
  }
  const auto topics = examine(recording);
  const nlohmann::ordered_json json = infoJson(recording, topics);
  if (options.json)
    std::cout << json.dump(2) << "\n";
  else
    printInfo(json);
  return recording.reportDamage() ? kFailure : kOk;
}

}  // namespace

void registerInfo(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<InfoCommand>();
  CLI::App* info = app.add_subcommand("info", "show topics, rates, losses and attachments of a recording");
  info->add_option("file", options->file, "MCAP file")->required();
  info->add_option("--attachment", options->attachment, "print this attachment and nothing else");
  info->add_flag("--check", options->check, "read the whole file and verify every checksum");
  info->add_flag("--json", options->json, "JSON instead of text");
  info->footer("Exit code 1: the file is damaged or incomplete; the valid part is shown.");
  info->callback([options, &exit_code] { guarded(exit_code, [&] { return runInfo(*options); }); });
}

}  // namespace tandem::cli
