// SPDX-License-Identifier: Apache-2.0
/** @file The deployment and the robot that a recording is of, by the configuration files in it. */
#pragma once

#include <map>
#include <string>

#include "config/config.h"
#include "recording/reader.h"

namespace tandem::recordings {

/// Metadata of a run (run_file.h); empty if the file has none.
std::map<std::string, std::string> valuesOfRun(const recording::Reader& reader);
/// A value of the metadata; empty if it is not there.
std::string valueIn(const std::map<std::string, std::string>& values, const std::string& key);
/// Whether the run is of this deployment and its robot, by their values: its wire version may be another one.
bool isRunOf(const config::Deployment& deployment, const std::map<std::string, std::string>& run);

/** Paths in it do not exist any more. */
struct RecordedSystem {
  config::Deployment deployment;
  config::Robot robot;
};

enum class RecordedHardware {
  kRead,     ///< the hardware file, if the deployment names one
  kLeaveOut  ///< the deployment is read as one without hardware
};

/// Reads the attachments deployment.yaml, robot.yaml and hardware.yaml.
/// @throw std::invalid_argument that names the attachment that is missing or refused, recording::Error, or
/// std::system_error if there is no room for temporary files
RecordedSystem readSystem(recording::Reader& reader, RecordedHardware hardware);

}  // namespace tandem::recordings
