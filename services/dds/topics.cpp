// SPDX-License-Identifier: Apache-2.0
#include "services/dds/topics.h"

#include <algorithm>
#include <stdexcept>

namespace tandem::dds {
namespace {

bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// A letter, then letters, digits and underscores, whatever the locale.
bool isWord(const std::string& text) {
  return !text.empty() && isLetter(text[0]) && std::all_of(text.begin(), text.end(), [](char c) {
    return isLetter(c) || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

const char* name(Profile profile) {
  switch (profile) {
    case Profile::kPeriodic:
      return "periodic";
    case Profile::kCommand:
      return "command";
    case Profile::kReliable:
      return "reliable";
    case Profile::kLatched:
      return "latched";
  }
  return "unknown";
}

std::vector<TopicInfo> allTopics(const std::vector<std::string>& arm_names) {
  std::vector<TopicInfo> topics;
  forEachTopic([&](const auto& topic) {
    const auto add = [&](const std::string& arm) {
      const std::string full = arm.empty() ? topic.name : arm + "/" + topic.name;
      topics.push_back({full, topic.type, topic.profile, arm, topic.publisher, topic.description});
    };
    if (!topic.per_arm) {
      add("");
      return;
    }
    for (const std::string& arm : arm_names) {
      add(arm);
    }
    if (topic.pair && arm_names.size() >= 2) {
      add(kPair);
    }
  });
  return topics;
}

std::string rosTopicName(const std::string& prefix, const std::string& name) {
  return name.starts_with('/') ? name : "/" + prefix + "/" + name;
}

std::string ddsTopicName(const std::string& prefix, const std::string& name, const std::string& arm) {
  bool good = true;
  std::size_t begin = 0;
  for (std::size_t end = 0; end != std::string::npos; begin = end + 1) {
    end = prefix.find('/', begin);
    good = good && isWord(prefix.substr(begin, end - begin));
  }
  if (!good) {
    throw std::invalid_argument("topic prefix '" + prefix + "': expected letters, digits and underscores, e.g. tandem");
  }
  if (!arm.empty() && !isWord(arm)) {
    throw std::invalid_argument("arm name '" + arm + "': expected letters, digits and underscores, e.g. arm_a");
  }
  return "rt" + rosTopicName(prefix, arm.empty() ? name : arm + "/" + name);
}

std::string ddsTypeName(const std::string& type) {
  const auto first = type.find('/');
  const auto last = type.rfind('/');
  if (first == std::string::npos || first == last) {
    throw std::invalid_argument("type name '" + type + "': expected package/msg/Type");
  }
  return type.substr(0, first) + "::" + type.substr(first + 1, last - first - 1) + "::dds_::" + type.substr(last + 1) +
         "_";
}

}  // namespace tandem::dds
