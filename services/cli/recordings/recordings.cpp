// SPDX-License-Identifier: Apache-2.0
#include "services/cli/recordings/recordings.h"

#include <fnmatch.h>

#include <algorithm>
#include <iostream>
#include <map>

#include "services/cli/subcommand.h"
#include "services/recordings/run_file.h"

namespace tandem::cli {
namespace {

recording::Reader open(const std::string& file, recording::Reader::Open how) {
  try {
    return recording::Reader(file, how);
  } catch (const recording::Error& error) {
    throw Failure(kUsage, error.what());
  }
}

/// Calls f(); converts recording errors to Failure.
template <class F>
auto asFailure(F&& f) {
  try {
    return f();
  } catch (const recording::Error& error) {
    throw Failure(kUsage, error.what());
  }
}

}  // namespace

Recording::Recording(const std::string& file, recording::Reader::Open how)
    : reader_(open(file, how)), upgrader_(reader_) {
  prefix_ = "/" + about("prefix") + "/";
}

std::string Recording::about(const std::string& key) const {
  for (const recording::Metadata& metadata : reader_.metadata()) {
    const auto value = metadata.values.find(key);
    if (metadata.name == recordings::kRunMetadata && value != metadata.values.end())
      return value->second;
  }
  return "";
}

std::string Recording::topicOf(const recording::Channel& channel) const {
  return channel.topic.starts_with(prefix_) ? channel.topic.substr(prefix_.size()) : channel.topic;
}

std::vector<std::string> Recording::topics() const {
  std::vector<std::string> names;
  for (const auto& [id, channel] : reader_.channels()) {
    if (std::find(names.begin(), names.end(), topicOf(channel)) == names.end())
      names.push_back(topicOf(channel));
  }
  return names;
}

recording::Selection Recording::select(const std::vector<std::string>& patterns) const {
  std::string known;
  for (const std::string& topic : topics())
    known += (known.empty() ? "" : ", ") + topic;
  const auto matches = [](const std::string& pattern, const std::string& topic) {
    return fnmatch(pattern.c_str(), topic.c_str(), 0) == 0;
  };
  for (const std::string& pattern : patterns) {
    const std::vector<std::string> all = topics();
    if (pattern != "*" &&
        std::none_of(all.begin(), all.end(), [&](const auto& topic) { return matches(pattern, topic); }))
      throw Failure(kUsage, reader_.file().string() + ": topics: found '" + pattern +
                                "', expected a name, or a pattern of one, among " + known);
  }
  recording::Selection selection;
  selection.channel = [this, patterns, matches](const recording::Channel& channel) {
    return std::any_of(patterns.begin(), patterns.end(),
                       [&](const std::string& pattern) { return matches(pattern, topicOf(channel)); });
  };
  return selection;
}

recording::Selection Recording::select(const std::vector<std::string>& patterns, double start, double seconds) const {
  recording::Selection selection = select(patterns);
  const recording::Statistics& statistics = reader_.statistics();
  if (start > 0.0 || seconds > 0.0) {
    selection.from = statistics.start + static_cast<std::uint64_t>(1e9 * start);
    if (seconds > 0.0)
      selection.to = selection.from + static_cast<std::uint64_t>(1e9 * seconds);
  }
  return selection;
}

std::vector<recording::Table> Recording::tables(const recording::Selection& selection) {
  std::vector<recording::Table> tables;
  std::map<std::string, std::size_t> places;
  std::map<std::string, std::uint64_t> bad;
  try {
    reader_.forEach(selection, [&](const recording::Channel& channel, const recording::Message& message) {
      const std::string topic = topicOf(channel);
      const auto [place, is_new] = places.try_emplace(topic, tables.size());
      if (is_new) {
        const auto schema = reader_.schemas().find(channel.schema);
        if (channel.encoding != "cdr" || schema == reader_.schemas().end())
          throw recording::Error("topic " + topic + ": found encoding '" + channel.encoding +
                                 "', expected cdr with a schema");
        tables.emplace_back(topic, schema->second);
      }
      if (!tables[place->second].add(message))
        ++bad[topic];
      return true;
    });
  } catch (const recording::Error& error) {
    throw Failure(kUsage, reader_.file().string() + ": " + error.what());
  }
  for (const auto& [topic, count] : bad)
    std::cerr << topic << ": " << count << " messages do not fit their definition and are left out\n";
  return tables;
}

std::string Recording::changes(const recording::Channel& channel) {
  return asFailure([&] { return upgrader_.changes(channel); });
}

std::optional<std::string> Recording::today(const recording::Channel& channel, std::string_view bytes) {
  if (reported_.insert(topicOf(channel)).second) {
    if (const std::string changes = this->changes(channel); !changes.empty())
      std::cerr << topicOf(channel) << ": " << changes << "\n";
  }
  return asFailure([&] { return upgrader_(channel, bytes); });
}

std::optional<std::string> Recording::back(const recording::Channel& channel, std::string_view bytes) {
  return asFailure([&] { return upgrader_.back(channel, bytes); });
}

std::string Recording::attachment(const std::string& name) {
  std::string known;
  for (std::size_t i = 0; i < reader_.attachments().size(); ++i) {
    if (reader_.attachments()[i].name == name)
      return reader_.attachmentData(i);
    known += (known.empty() ? "" : ", ") + reader_.attachments()[i].name;
  }
  throw Failure(kUsage, reader_.file().string() + ": attachment '" + name +
                            "' not found; the file contains: " + (known.empty() ? "none" : known));
}

bool Recording::reportDamage() const {
  for (const std::string& damage : reader_.damage())
    std::cerr << damage << "\n";
  return !reader_.damage().empty();
}

}  // namespace tandem::cli
