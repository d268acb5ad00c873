// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/run_file.h"

#include <fnmatch.h>
#include <sys/utsname.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "config/suggestion.h"
#include "config/values.h"
#include "idl/version.h"
#include "services/dds/definitions.h"
#include "services/runtime/identity.h"

namespace tandem::recordings {
namespace {

std::string utc(std::uint64_t nanoseconds, const char* format) {
  const auto seconds = static_cast<time_t>(nanoseconds / 1'000'000'000);
  tm parts{};
  gmtime_r(&seconds, &parts);
  char text[64];
  strftime(text, sizeof text, format, &parts);
  char milliseconds[8];
  std::snprintf(milliseconds, sizeof milliseconds, ".%03uZ", static_cast<unsigned>(nanoseconds / 1'000'000 % 1000));
  return std::string(text) + milliseconds;
}

std::string hex(const std::array<std::uint8_t, 16>& bytes) {
  std::string text;
  char two[3];
  for (std::uint8_t byte : bytes) {
    std::snprintf(two, sizeof two, "%02x", byte);
    text += two;
  }
  return text;
}

std::string contentsOf(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

std::uint64_t wallClock() {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count());
}

std::string timeName(std::uint64_t nanoseconds) { return utc(nanoseconds, "%Y-%m-%dT%H-%M-%S"); }

RunInfo describeRun(const config::Deployment& deployment, const config::Robot& robot) {
  utsname system{};
  uname(&system);
  RunInfo info;
  std::string arms, joints;
  for (const config::Arm& arm : robot.arms) {
    arms += (arms.empty() ? "" : ",") + arm.name;
    joints += (joints.empty() ? "" : ",") + std::to_string(arm.limits.jointCount());
  }
  const std::uint64_t now = wallClock();
  info.values = {{"version", TANDEM_VERSION},
                 {"wire", config::fingerprintText(idl::kWireVersion)},
                 {"fingerprint", config::fingerprintText(runtime::fingerprintOf(deployment))},
                 {"created", utc(now, "%Y-%m-%dT%H:%M:%S")},
                 {"host", system.nodename},
                 {"kernel", std::string(system.sysname) + " " + system.release + " " + system.machine},
                 {"deployment", deployment.name},
                 {"robot", robot.name},
                 {"prefix", deployment.prefix},
                 {"domain", std::to_string(deployment.domain)},
                 {"clock", deployment.clock == config::ClockMode::kLockStep ? "lock_step" : "real_time"},
                 {"method", std::string(control::name(deployment.method))},
                 {"arms", arms},
                 {"joints", joints}};
  if (!deployment.method_library.empty())
    info.values["method_library"] = deployment.method_library.string();
  const auto attach = [&](const std::string& name, const std::filesystem::path& file) {
    if (!file.empty())
      info.files.push_back({now, now, name, "application/yaml", contentsOf(file)});
  };
  attach("deployment.yaml", deployment.file);
  attach("robot.yaml", robot.file);
  attach("hardware.yaml", deployment.hardware);
  return info;
}

std::vector<dds::TopicInfo> chooseTopics(const std::vector<dds::TopicInfo>& all,
                                         const std::vector<std::string>& patterns) {
  std::vector<bool> chosen(all.size());
  std::vector<std::string> known;
  for (const dds::TopicInfo& topic : all)
    known.push_back(topic.name);
  for (const std::string& pattern : patterns) {
    bool matches = false;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (fnmatch(pattern.c_str(), all[i].name.c_str(), 0) == 0)
        chosen[i] = matches = true;
    }
    if (!matches) {
      const std::string nearest = config::nearestWord(pattern, known);
      throw std::invalid_argument(
          "topics: found '" + pattern +
          "', expected a name that `tandem topics` lists, or a pattern of one, without the prefix" +
          (nearest.empty() ? "" : "; did you mean " + nearest + "?"));
    }
  }
  std::vector<dds::TopicInfo> topics;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (chosen[i])
      topics.push_back(all[i]);
  }
  return topics;
}

RunFile::RunFile(const std::filesystem::path& file,
                 const RunInfo& info,
                 const std::string& prefix,
                 const std::vector<dds::TopicInfo>& topics)
    : writer_(file, {.library = std::string("tandem ") + TANDEM_VERSION}), prefix_(prefix), topics_(topics) {
  writer_.add({kRunMetadata, info.values});
  for (const recording::Attachment& attachment : info.files)
    writer_.attach(attachment);
}

void RunFile::write(const recording::SampleTag& tag, std::string_view bytes) {
  std::uint16_t& channel = channels_[{tag.topic, tag.writer}];
  if (channel == 0) {
    const dds::TopicInfo& topic = topics_.at(tag.topic);
    const auto schema = writer_.addSchema(topic.type, "ros2msg", dds::messageDefinition(topic.type));
    channel = writer_.addChannel(dds::rosTopicName(prefix_, topic.name), schema,
                                 {{"offered_qos_profiles", dds::offeredQos(topic.profile)},
                                  {"profile", dds::name(topic.profile)},
                                  {"writer", hex(tag.writer)}});
  }
  writer_.write({channel, static_cast<std::uint32_t>(tag.sequence), tag.log_time, tag.publish_time, bytes});
}

}  // namespace tandem::recordings
