// SPDX-License-Identifier: Apache-2.0
#include "config/robot_files.h"

#include <algorithm>

#include "config/cooperative.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "config/planar.h"

namespace tandem::config {
namespace {

void checkNothing(const Map&, const Deployment&) {}

}  // namespace

const std::vector<RobotFile>& robotFiles() {
  static const std::vector<RobotFile> all{
      {"robot", "robots", robotTable, loadRobot, checkNothing},
      {"cooperative", "cooperative", cooperativeTable, loadCatheterRobot, checkCatheterDeployment},
      {"planar", "planar", planarTable, loadPlanarRobot, checkPlanarDeployment},
  };
  return all;
}

std::string robotKinds() {
  std::string kinds;
  for (const RobotFile& type : robotFiles())
    kinds += (kinds.empty() ? "" : "|") + type.kind;
  return kinds;
}

std::string kindOf(const std::filesystem::path& file) { return Document(file.string(), readFile(file)).kind(); }

const RobotFile& robotFileOf(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const auto found = std::ranges::find(robotFiles(), document.kind(), &RobotFile::kind);
  if (found == robotFiles().end())
    document.check(robotTable());
  return *found;
}

Robot loadAnyRobot(const std::filesystem::path& file) { return robotFileOf(file).load(file); }

Robot loadAnyRobot(const Deployment& deployment) {
  Robot robot = loadAnyRobot(deployment.robot);
  setReadingErrors(deployment.plant.encoders, robot);
  return robot;
}

void setReadingErrors(const sim::EncoderOptions& encoders, Robot& robot) {
  constexpr double kDeviations = 8.0;
  const auto error_of = [&](safety::JointKind kind) {
    return 0.5 * encoders.resolution.of(kind) + kDeviations * encoders.noise.of(kind);
  };
  for (Arm& arm : robot.arms) {
    for (safety::JointLimit& joint : arm.limits.joints)
      joint.reading_error = error_of(joint.kind);
    // Equation (1) compares the readings of two tubes.
    arm.model.tolerance = safety::kPositionTolerance + 2.0 * error_of(safety::JointKind::kTranslation);
  }
}

Robot withoutReadingErrors(Robot robot) {
  for (Arm& arm : robot.arms) {
    for (safety::JointLimit& joint : arm.limits.joints)
      joint.reading_error = safety::JointLimit{}.reading_error;
    arm.model.tolerance = kinematics::ConcentricTubeArm{}.tolerance;
  }
  return robot;
}

}  // namespace tandem::config
