// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/message_upgrader.h"

#include <stdexcept>

#include "services/dds/definitions.h"

namespace tandem::recordings {
namespace {

/// "a, b"
std::string list(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

const MessageUpgrader::Pair* MessageUpgrader::pair(const recording::Channel& channel) {
  const auto [place, is_new] = pairs_.try_emplace(channel.schema);
  const auto schema = reader_.schemas().find(channel.schema);
  if (is_new && channel.encoding == "cdr" && schema != reader_.schemas().end() &&
      schema->second.encoding == "ros2msg") {
    std::string today;
    try {
      today = dds::messageDefinition(schema->second.name);
    } catch (const std::invalid_argument&) {
      return nullptr;  // a type of other software
    }
    const auto then = recording::parseDefinition(schema->second.name, schema->second.data);
    const auto now = recording::parseDefinition(schema->second.name, today);
    if (recording::Conversion forth(then, now); !forth.same())
      place->second = Pair{std::move(forth), recording::Conversion(now, then)};
  }
  if (!place->second)
    return nullptr;
  if (const auto& mismatched = place->second->forth.mismatched(); !mismatched.empty())
    throw recording::Error(reader_.file().string() + ": " + channel.topic + ": the definition of " +
                           schema->second.name + " has changed and cannot be converted: " + list(mismatched) +
                           "; tandem export and tandem plot can read it");
  return &*place->second;
}

std::string MessageUpgrader::changes(const recording::Channel& channel) {
  const Pair* found = pair(channel);
  if (!found)
    return "";
  const std::string added = list(found->forth.added()), dropped = list(found->forth.dropped());
  return (added.empty() ? "" : "members missing in the recording: " + added + ": set to 0 or empty") +
         (added.empty() || dropped.empty() ? "" : "; ") +
         (dropped.empty() ? "" : "members that no longer exist: " + dropped + ": left out");
}

std::optional<std::string> MessageUpgrader::operator()(const recording::Channel& channel, std::string_view bytes) {
  const Pair* found = pair(channel);
  return found ? found->forth(bytes) : std::string(bytes);
}

std::optional<std::string> MessageUpgrader::back(const recording::Channel& channel, std::string_view bytes) {
  const Pair* found = pair(channel);
  return found ? found->back(bytes) : std::string(bytes);
}

}  // namespace tandem::recordings
