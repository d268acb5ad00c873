// SPDX-License-Identifier: Apache-2.0
/** @file Table of robot types: key table and loader of the files of each type. */
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/config.h"
#include "config/key_table.h"

namespace tandem::config {

class Map;

/** Files of one robot type: key table and loader. */
struct RobotFile {
  std::string kind;     ///< the first key of a file is `tandem: KIND/1`
  std::string presets;  ///< folder of the presets
  const Mapping& (*table)();
  Robot (*load)(const std::filesystem::path& file);  ///< @throw Error
  /// Refuses values of a deployment that this robot type does not support. @throw Error at the key
  void (*check_deployment)(const Map& map, const Deployment& deployment);
};

/// All robot types; docs/own-robot-type.md describes how to add one.
const std::vector<RobotFile>& robotFiles();

/// "robot|cooperative|...", for findFile().
std::string robotKinds();

/// "robot" if the first key is `tandem: robot/1`. @throw Error if a file has no known kind.
std::string kindOf(const std::filesystem::path& file);

/// Type of a robot file. @throw Error for a file of another kind.
const RobotFile& robotFileOf(const std::filesystem::path& file);

/// Loads a robot of any type. @throw Error as the type's loader does.
Robot loadAnyRobot(const std::filesystem::path& file);

/// The same for the robot of a deployment, with setReadingErrors() of its plant.
Robot loadAnyRobot(const Deployment& deployment);

/** Sets JointLimit::reading_error of all joints: half a count and eight standard deviations of the noise. Tube models
 * accept readings that violate equation (1) by the reading errors of both tubes and safety::kPositionTolerance. */
void setReadingErrors(const sim::EncoderOptions& encoders, Robot& robot);

/// The robot before setReadingErrors(): for models of joints that are computed, not read.
Robot withoutReadingErrors(Robot robot);

}  // namespace tandem::config
