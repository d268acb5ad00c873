// SPDX-License-Identifier: Apache-2.0
/** @file MCAP files of one robot, with configuration files and metadata as attachments. */
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/config.h"
#include "recording/sample_ring.h"
#include "recording/writer.h"
#include "services/dds/topics.h"

namespace tandem::recordings {

/// Name of the metadata record in every file of Tandem.
inline constexpr const char* kRunMetadata = "tandem";

/** Description of a run in its file: metadata, and the configuration as attachments. */
struct RunInfo {
  std::map<std::string, std::string> values;
  std::vector<recording::Attachment> files;  ///< deployment.yaml, robot.yaml, hardware.yaml
};

/// Version, host, kernel, names, arms, and the present configuration files.
RunInfo describeRun(const config::Deployment& deployment, const config::Robot& robot);

/// ns since the epoch.
std::uint64_t wallClock();

/// "2026-11-21T17-15-30.123Z", for file names.
std::string timeName(std::uint64_t nanoseconds);

/// Topics whose names match one of the patterns, in which * matches any text.
/// @throw std::invalid_argument for a pattern that matches none, with a list of all topics.
std::vector<dds::TopicInfo> chooseTopics(const std::vector<dds::TopicInfo>& all,
                                         const std::vector<std::string>& patterns);

/** One file. Each writer of a topic gets a separate channel, with the writer's sequence numbers: a gap is a lost
 * sample. */
class RunFile {
 public:
  /// @param prefix  of the robot: topic names are /PREFIX/NAME, as in ROS 2
  /// @throw std::system_error, as do all other functions.
  RunFile(const std::filesystem::path& file,
          const RunInfo& info,
          const std::string& prefix,
          const std::vector<dds::TopicInfo>& topics);

  void write(const recording::SampleTag& tag, std::string_view bytes);
  recording::Writer& mcap() { return writer_; }

 private:
  recording::Writer writer_;
  std::string prefix_;
  const std::vector<dds::TopicInfo>& topics_;
  std::map<std::pair<std::uint32_t, std::array<std::uint8_t, 16>>, std::uint16_t> channels_;
};

}  // namespace tandem::recordings
