// SPDX-License-Identifier: Apache-2.0
#include "services/console/replay.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>

#include "config/arm_names.h"
#include "recording/bytes.h"
#include "services/console/access.h"
#include "services/console/api.h"
#include "services/console/decimation.h"
#include "services/console/numbers.h"
#include "services/console/protocol.h"
#include "services/dds/definitions.h"
#include "services/recordings/run_file.h"

namespace tandem::console {
namespace {

namespace fs = std::filesystem;
using recordings::valueIn, recordings::valuesOfRun;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* kEnding = ".mcap";
constexpr std::size_t kLongestName = 200, kLongestTopics = 2000, kMostMarks = 1000;
constexpr double kLatest = 9e12;  // ms since the epoch; as ns it fits 64 bits

[[noreturn]] void fail(const std::string& what) { throw std::invalid_argument(what); }

/// A file name: no path leaves the folder.
std::string nameIn(std::string_view query) {
  const std::string name = decoded(parameterOf(query, "file"));
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("-_.+").find(c) != std::string_view::npos;
  });
  if (name.empty() || name.size() > kLongestName || !plain || name.front() == '.' || !name.ends_with(kEnding))
    fail("file: expected the name of a recording in the folder, as /api/recordings lists them");
  return name;
}

double numberIn(std::string_view query, const char* name, double least, double most) {
  return numberOf(name, parameterOf(query, name),
                  "a number from " + std::to_string(least) + " to " + std::to_string(most), least, most);
}

std::set<std::uint32_t> channelsIn(std::string_view query, std::size_t count) {
  std::istringstream parts{decoded(parameterOf(query, "topics")).substr(0, kLongestTopics)};
  const std::string expected = "numbers of channels below " + std::to_string(count) + ", separated by commas";
  std::set<std::uint32_t> channels;
  for (std::string part; std::getline(parts, part, ',');) {
    const double channel = numberOf("topics", part, expected, 0.0, static_cast<double>(count) - 1.0);
    if (channel != std::floor(channel))
      fail("topics: found '" + part.substr(0, 40) + "', expected " + expected);
    channels.insert(static_cast<std::uint32_t>(channel));
  }
  return channels;
}

double milliseconds(std::uint64_t time) { return 1e-6 * static_cast<double>(time); }

Json marksOf(const recording::Reader& reader) {
  Json marks = Json::array();
  for (const recording::Metadata& metadata : reader.metadata()) {
    if (metadata.name.starts_with("mark ") && marks.size() < kMostMarks)
      marks.push_back({{"time_ms", 1e-6 * std::strtod(valueIn(metadata.values, "time_ns").c_str(), nullptr)},
                       {"text", valueIn(metadata.values, "text")}});
  }
  return marks;
}

}  // namespace

std::string beginSamples(std::uint64_t reached) {
  std::string answer;
  recording::ByteSink(answer).number(reached);
  return answer;
}

void appendSample(std::string& answer, std::uint32_t channel, std::uint64_t time, std::string_view cdr) {
  const MessageHeader header = messageHeader(channel, time);
  recording::ByteSink(answer)
      .number(static_cast<std::uint32_t>(header.size() + cdr.size()))
      .raw({reinterpret_cast<const char*>(header.data()), header.size()})
      .raw(cdr);
}

Replay::Replay(fs::path folder, const config::Deployment& deployment, const config::Robot& robot)
    : folder_(std::move(folder)), deployment_(deployment), robot_(robot) {}

Json Replay::list() const {
  std::vector<std::pair<std::string, std::uintmax_t>> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (entry->path().extension() == kEnding && entry->is_regular_file(unreadable))
      files.emplace_back(entry->path().filename().string(), entry->file_size(unreadable));
  }
  std::sort(files.rbegin(), files.rend());  // names begin with the time
  Json list = Json::array();
  for (const auto& [name, size] : files)
    list.push_back({{"file", name}, {"bytes", size}});
  return {{"folder", folder_.string()}, {"recordings", list}};
}

/// The recording's own robot and deployment; null: those of the console. @throw std::invalid_argument
std::unique_ptr<recordings::RecordedSystem> Replay::otherSystem(recording::Reader& reader) const {
  const auto run = valuesOfRun(reader);
  if (valueIn(run, "fingerprint").empty())
    fail("found no fingerprint of the robot, expected a recording that Tandem has made since version 0.1");
  if (reader.statistics().messages == 0)
    fail("contains no messages");
  if (recordings::isRunOf(deployment_, run))
    return nullptr;
  std::string why;
  try {
    auto other = std::make_unique<recordings::RecordedSystem>(
        recordings::readSystem(reader, recordings::RecordedHardware::kRead));
    if (recordings::isRunOf(other->deployment, run))
      return other;
    why = "the configuration in it has other values in this version of Tandem";
  } catch (const std::exception& error) {
    why = error.what();
  }
  fail("is of another robot or deployment, " + valueIn(run, "robot") + " · " + valueIn(run, "deployment") +
       ", recorded " + valueIn(run, "created") + ", and does not describe it completely: " + why);
}

Replay::Opened& Replay::open(std::string_view query, bool as_it_is_now) {
  const std::string name = nameIn(query);
  std::error_code error;
  // Symbolic links may point outside the folder.
  const fs::path path = fs::canonical(folder_ / name, error);
  if (error || path.parent_path() != fs::canonical(folder_, error) || !fs::is_regular_file(path, error))
    fail(name + ": found no such file in the folder of recordings");
  const auto changed = fs::last_write_time(path, error);
  const std::uintmax_t size = fs::file_size(path, error);
  if (error)
    fail(name + ": " + error.message());
  if (opened_.reader && opened_.path == path && (!as_it_is_now || (opened_.changed == changed && opened_.size == size)))
    return opened_;
  opened_ = {};
  try {
    Opened opened{path, changed, size, nullptr, nullptr, nullptr, nullptr, {}, {}};
    opened.reader = std::make_unique<recording::Reader>(
        path, size > kUnindexed ? recording::Reader::Open::kIndexed : recording::Reader::Open::kFast, kMemory);
    try {
      opened.other = otherSystem(*opened.reader);
    } catch (const std::invalid_argument& refused) {
      fail(name + ": " + refused.what());
    }
    opened.topics = dds::allTopics(config::armList(opened.other ? opened.other->robot : robot_));
    opened.upgrader = std::make_unique<recordings::MessageUpgrader>(*opened.reader);
    const std::string prefix = valueIn(valuesOfRun(*opened.reader), "prefix");
    for (const auto& [id, channel] : opened.reader->channels()) {
      const auto schema = opened.reader->schemas().find(channel.schema);
      for (std::uint32_t k = 0; k < opened.topics.size(); ++k) {
        const dds::TopicInfo& topic = opened.topics[k];
        if (channel.encoding == "cdr" && schema != opened.reader->schemas().end() &&
            schema->second.name == topic.type && channel.topic == dds::rosTopicName(prefix, topic.name))
          opened.channels[id] = k;
      }
    }
    opened_ = std::move(opened);
  } catch (const recording::Error& unusable) {
    fail(unusable.what());
  }
  return opened_;
}

Json Replay::describe(std::string_view query) {
  const Opened& file = open(query, true);
  const auto run = valuesOfRun(*file.reader);
  const recording::Statistics& statistics = file.reader->statistics();
  const std::string& prefix = (file.other ? file.other->deployment : deployment_).prefix;
  Json channels = Json::array(), definitions = Json::object();
  std::set<std::uint32_t> recorded;
  for (const auto& [id, topic] : file.channels)
    recorded.insert(topic);
  for (const std::uint32_t k : recorded) {
    const dds::TopicInfo& topic = file.topics[k];
    channels.push_back({{"id", k}, {"topic", dds::rosTopicName(prefix, topic.name)}, {"type", topic.type}});
    definitions[topic.type] = dds::messageDefinition(topic.type);
  }
  return {{"file", file.path.filename().string()},
          {"robot", valueIn(run, "robot")},
          {"deployment", valueIn(run, "deployment")},
          {"start_ms", milliseconds(statistics.start)},
          {"end_ms", milliseconds(statistics.end)},
          {"messages", statistics.messages},
          {"marks", marksOf(*file.reader)},
          {"damage", file.reader->damage()},
          {"channels", channels},
          {"definitions", definitions},
          {"description", file.other ? describeRobot(file.other->deployment, file.other->robot) : Json(nullptr)}};
}

std::string Replay::samples(std::string_view query) {
  Opened& file = open(query, false);
  const double rate = numberIn(query, "rate", kLeastRate, kMostRate);
  const std::set<std::uint32_t> wanted = channelsIn(query, file.topics.size());
  recording::Selection selection;
  selection.from = static_cast<std::uint64_t>(1e6 * numberIn(query, "from", 0.0, kLatest));
  selection.to = static_cast<std::uint64_t>(1e6 * numberIn(query, "to", 0.0, kLatest));
  selection.channel = [&](const recording::Channel& channel) {
    const auto known = file.channels.find(channel.id);
    return known != file.channels.end() && wanted.contains(known->second);
  };
  std::map<std::uint32_t, Decimation> decimations;
  std::string answer;
  std::uint64_t reached = selection.to, last = 0;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kTime));
  try {
    file.reader->forEach(selection, [&](const recording::Channel& channel, const recording::Message& message) {
      // All samples of one time are in one answer, and at least those of one.
      if (last != 0 && message.log_time > last && (answer.size() > kAnswer || Clock::now() > end)) {
        reached = message.log_time;
        return false;
      }
      last = message.log_time;
      const std::uint32_t k = file.channels.at(channel.id);
      const auto cdr = (*file.upgrader)(channel, message.data);
      if (!cdr)
        return true;  // does not fit its definition
      auto& decimation =
          decimations.try_emplace(k, isStream(file.topics[k].profile) ? static_cast<std::uint64_t>(1e9 / rate) : 0)
              .first->second;
      const HubSample sample{std::make_shared<const std::string>(*cdr), message.log_time};
      for (const HubSample& selected :
           decimation.take(sample, decimation.limited() ? featuresOf(file.topics[k].type, *cdr) : SampleFeatures{}))
        appendSample(answer, k, selected.time, *selected.bytes);
      return true;
    });
  } catch (const recording::Error& unusable) {
    fail(unusable.what());
  }
  return beginSamples(reached) + answer;
}

std::string Replay::span(std::string_view query) {
  Opened& file = open(query, false);
  if (!file.shapes)
    file.shapes = file.other ? std::make_unique<Shapes>(file.other->robot, file.other->deployment.model)
                             : std::make_unique<Shapes>(robot_, deployment_.model);
  return file.shapes->span(Shapes::spanIn(query));
}

}  // namespace tandem::console
