// SPDX-License-Identifier: Apache-2.0
#include "services/dds/definitions.h"

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace tandem::dds {
namespace {

const std::map<std::string, std::string>& definitions() {
  static const std::map<std::string, std::string> all{
#include "message_definitions.inc"
  };
  return all;
}

/// "std_msgs/Header[3]" in a definition of package p -> "std_msgs/msg/Header"; "Point" -> "p/msg/Point".
std::string fullName(std::string word, const std::string& package) {
  word = word.substr(0, word.find('['));
  const auto slash = word.find('/');
  return slash == std::string::npos ? package + "/msg/" + word
                                    : word.substr(0, slash) + "/msg/" + word.substr(slash + 1);
}

void collect(const std::string& type, std::vector<std::string>& found) {
  std::istringstream lines(definitions().at(type));
  const std::string package = type.substr(0, type.find('/'));
  for (std::string line; std::getline(lines, line);) {
    const std::string used = fullName(line.substr(0, line.find(' ')), package);
    if (definitions().contains(used) && std::find(found.begin(), found.end(), used) == found.end()) {
      found.push_back(used);
      collect(used, found);
    }
  }
}

}  // namespace

std::string messageDefinition(const std::string& type) {
  if (!definitions().contains(type))
    throw std::invalid_argument("type '" + type + "': unknown message type");
  std::vector<std::string> types;
  collect(type, types);
  std::string text = definitions().at(type);
  for (const std::string& used : types) {
    std::string name = used;
    text += std::string(80, '=') + "\nMSG: " + name.erase(name.find("/msg"), 4) + "\n" + definitions().at(used);
  }
  return text;
}

std::string offeredQos(Profile profile) {
  const bool reliable = profile == Profile::kReliable || profile == Profile::kLatched;
  const bool latched = profile == Profile::kLatched;
  const std::string forever = "\n    sec: 9223372036\n    nsec: 854775807\n";
  return "- history: 1\n  depth: " + std::string(latched ? "1" : "64") + "\n  reliability: " + (reliable ? "1" : "2") +
         "\n  durability: " + (latched ? "1" : "2") + "\n  deadline:" + forever + "  lifespan:" + forever +
         "  liveliness: 1\n  liveliness_lease_duration:" + forever + "  avoid_ros_namespace_conventions: false";
}

}  // namespace tandem::dds
