// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/recorded_system.h"

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "config/deployment_copy.h"
#include "config/robot_files.h"
#include "config/values.h"
#include "services/recordings/run_file.h"
#include "services/runtime/temporary_folder.h"

namespace tandem::recordings {
namespace {

namespace fs = std::filesystem;

/// Writes an attachment as a file, if the recording has it. @return the file
fs::path writeAttachment(recording::Reader& reader, const std::string& name, const fs::path& folder) {
  const fs::path file = folder / name;
  for (std::size_t k = 0; k < reader.attachments().size(); ++k) {
    if (reader.attachments()[k].name != name)
      continue;
    std::ofstream out(file, std::ios::binary);
    out << reader.attachmentData(k);
    if (!out.flush())
      throw std::system_error(errno, std::generic_category(), file.string());
    break;
  }
  return file;
}

}  // namespace

std::map<std::string, std::string> valuesOfRun(const recording::Reader& reader) {
  for (const recording::Metadata& metadata : reader.metadata()) {
    if (metadata.name == kRunMetadata)
      return metadata.values;
  }
  return {};
}

std::string valueIn(const std::map<std::string, std::string>& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? "" : found->second;
}

bool isRunOf(const config::Deployment& deployment, const std::map<std::string, std::string>& run) {
  const std::uint64_t wire = std::strtoull(valueIn(run, "wire").c_str(), nullptr, 16);
  return valueIn(run, "fingerprint") == config::fingerprintText(config::fingerprintOf(deployment.values, wire));
}

RecordedSystem readSystem(recording::Reader& reader, RecordedHardware hardware) {
  const runtime::TemporaryFolder folder;
  config::CompanionFiles companions;
  const fs::path file = writeAttachment(reader, "deployment.yaml", folder.path());
  companions.robot = writeAttachment(reader, "robot.yaml", folder.path());
  if (hardware == RecordedHardware::kRead)
    companions.hardware = writeAttachment(reader, "hardware.yaml", folder.path());
  try {
    RecordedSystem system;
    system.deployment = config::loadDeployment(file, companions);
    system.robot = config::loadAnyRobot(system.deployment);
    return system;
  } catch (const config::Error& error) {
    std::string what = error.what();
    const std::string prefix = folder.path().string() + "/";
    for (std::size_t at = what.find(prefix); at != std::string::npos; at = what.find(prefix))
      what.erase(at, prefix.size());
    throw std::invalid_argument("attachment of the recording: " + what);
  }
}

}  // namespace tandem::recordings
