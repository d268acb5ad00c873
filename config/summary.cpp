// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <variant>

#include "config/arm_names.h"
#include "config/cooperative.h"
#include "config/detail/loaders.h"
#include "config/drive_profile.h"
#include "config/file_tables.h"
#include "config/path.h"
#include "config/robot_files.h"
#include "hal/fieldbus.h"

namespace tandem::config {
namespace {

std::string count(std::size_t number, const std::string& what, const std::string& plural) {
  return std::to_string(number) + " " + (number == 1 ? what : plural);
}

std::string shapeName(const planning::Shape& shape) {
  constexpr const char* kNames[] = {"rectangle", "lissajous", "circle", "line", "waypoints", "insertion"};
  static_assert(std::size(kNames) == std::variant_size_v<planning::Shape>);
  return kNames[shape.index()];
}

Summary summarize(const Robot& robot) {
  std::vector<std::string> arms;
  for (const Arm& arm : robot.arms) {
    const std::string tubes = arm.model.tubes.empty() ? "" : count(arm.model.tubes.size(), "tube", "tubes") + ", ";
    arms.push_back(arm.name + ": " + tubes + count(arm.home.size(), "joint", "joints"));
  }
  return {robot.type,
          "robot " + robot.name + ": " + count(arms.size(), "arm", "arms") + " (" + join(arms, "; ") + ")" +
              (robot.hardware ? ", hardware" : ", simulated"),
          robot.warnings};
}

Summary summarize(const Experiment& experiment) {
  std::vector<std::string> methods;
  for (const control::Method method : experiment.methods)
    methods.emplace_back(name(method));
  std::size_t runs = 0;
  for (const ExperimentTrajectory& trajectory : experiment.trajectories)
    runs += trajectory.configurations.size();
  const Robot robot = loadAnyRobot(experiment.robot);
  return {"experiment",
          "experiment " + experiment.name + ": robot " + robot.name + ", " +
              count(experiment.configurations.size(), "configuration", "configurations") + ", " +
              count(experiment.trajectories.size(), "trajectory", "trajectories") + ", " +
              count(methods.size(), "method", "methods") + " (" + join(methods) + "), " +
              count(runs * methods.size(), "run", "runs"),
          robot.warnings};
}

Summary summarize(const Deployment& deployment) {
  const Robot robot = loadAnyRobot(deployment.robot);
  std::vector<std::string> processes;
  for (const Process& process : deployment.processes)
    processes.push_back(process.name);
  std::vector<std::string> warnings = robot.warnings;
  warnings.insert(warnings.end(), deployment.warnings.begin(), deployment.warnings.end());
  return {"deployment",
          "deployment " + deployment.name + ": robot " + robot.name + ", " +
              (deployment.clock == ClockMode::kLockStep ? "lock-step" : "real time") + ", control period " +
              formatNumber(deployment.control_period * 1e3) + " ms, " + std::string(name(deployment.method)) + ", " +
              count(processes.size(), "process", "processes") + " (" + join(processes) + ")",
          warnings};
}

/// Warnings for axes that tandem-hal will refuse, because their drive profiles lack protections.
std::vector<std::string> missingAcceptances(const hal::HardwareConfig& hardware) {
  std::vector<std::string> warnings;
  for (const hal::AxisConfig& axis : hardware.axes) {
    for (const hal::ProtectionMask set : hal::missingProtections(axis.foretold.value_or(0), axis.accepted))
      warnings.push_back(axis.name + ": the profile of its drive lacks " + hal::describeProtections(set) +
                         ": tandem-hal refuses the drive unless `accept` of the axis names it, with the reason");
  }
  return warnings;
}

/// Real axes whose first motion may go farther with a wrong unit than by default.
std::vector<std::string> wideFirstMotions(const hal::HardwareConfig& hardware) {
  std::vector<std::string> warnings;
  for (const hal::AxisConfig& axis : hardware.axes) {
    const double usual = axis.translation ? hal::kFirstTranslation : hal::kFirstRotation;
    const double shown = axis.translation ? 1e3 : 180.0 / std::numbers::pi;
    const std::string unit = axis.translation ? " mm" : " deg";
    if (!hardware.simulated && axis.first_motion > usual * (1.0 + 1e-9))
      warnings.push_back(axis.name + ": first_motion is " + formatNumber(axis.first_motion * shown) + unit +
                         ", expected at most " + formatNumber(usual * shown) + unit +
                         " for real drives: with a wrong unit the first motion may go that far");
  }
  return warnings;
}

/// "; by their profiles 4 axes may lack speed_limit (6080)".
std::string foretoldLosses(const hal::HardwareConfig& hardware) {
  std::map<hal::ProtectionMask, std::size_t> axes;
  for (const hal::AxisConfig& axis : hardware.axes)
    ++axes[axis.foretold.value_or(0)];
  std::string text;
  for (const auto& [lost, number] : axes) {
    if (lost != 0)
      text += "; by their profile " + count(number, "axis", "axes") + " may lack " + hal::describeProtections(lost);
  }
  return text;
}

Summary summarize(const hal::HardwareConfig& hardware) {
  std::vector<std::string> warnings = missingAcceptances(hardware);
  for (std::string& warning : wideFirstMotions(hardware))
    warnings.push_back(std::move(warning));
  std::vector<std::string> buses;
  for (std::size_t b = 0; b < hardware.buses.size(); ++b) {
    if (hal::inLibrary(hardware.buses[b])) {
      buses.push_back(hardware.buses[b].name + " on " + hardware.buses[b].address);
      continue;
    }
    const hal::BusLoad load = hal::computeLoad(hardware.planOf(static_cast<int>(b), safety::Budgets{}.drive_heartbeat));
    buses.push_back(hardware.buses[b].name + " on " + hardware.buses[b].address + " at " +
                    formatNumber(std::round(1e3 * load.load) / 10.0) + " % load");
  }
  return {"hardware",
          "hardware " + hardware.name + ": " + count(hardware.axes.size(), "axis", "axes") + ", " +
              count(buses.size(), "bus", "buses") + " (" + join(buses, "; ") + "), period " +
              formatNumber(1e3 * hardware.period) + " ms" + (hardware.simulated ? ", simulated" : "") +
              foretoldLosses(hardware),
          warnings};
}

Summary summarize(const DriveProfile& profile) {
  return {"drive",
          "drive profile " + profile.name + ": " + profile.model + ", modes " + join(profile.modes) + ", " +
              count(profile.sdo.size(), "value", "values") + " written at boot, " +
              count(profile.lacks.size(), "protection", "protections") + " lacking",
          {}};
}

Summary summarize(const planning::TrajectorySpec& spec) {
  return {"trajectory",
          "trajectory " + spec.name + ": " + shapeName(spec.shape) + " of arm " +
              nameOrLetter(spec.arm_name, spec.arm) + ", " +
              count(static_cast<std::size_t>(spec.point_count), "point", "points") +
              (spec.hasRelative() ? ", relative position to arm " + nameOrLetter(spec.other_arm_name, spec.other_arm) +
                                        " " + (spec.relative.empty() ? "held" : "moved")
                                  : "") +
              (spec.further.empty() ? "" : ", " + count(spec.further.size(), "further task", "further tasks")),
          {}};
}

Summary summarize(const planning::ObjectPath& path) {
  std::vector<std::string> directions;
  for (const int direction : path.directions)
    directions.push_back(planning::directionName(direction));
  return {"path",
          "path " + path.name + ": " + nameOf(path.shape) + " along " + join(directions) + " of " +
              formatNumber(1e3 * path.size) + " mm in " + formatNumber(path.duration) +
              " s, held: " + nameOf(path.kept),
          {}};
}

Summary summarize(const CooperativeRobot& robot) {
  std::string text = "cooperative robot " + robot.name + ": " + count(robot.arms.size(), "catheter", "catheters");
  if (robot.object) {
    std::vector<std::string> contacts;
    for (std::size_t k = 0; k < robot.object->contacts.size(); ++k) {
      contacts.push_back(robot.arms[static_cast<std::size_t>(robot.object->arms[k])].name + " " +
                         std::string(nameOf(robot.object->contacts[k].type)));
    }
    text += ", an object held by " + join(contacts);
  }
  if (robot.assistance) {
    text += ", " + robot.arms[static_cast<std::size_t>(robot.assistance->assist)].name + " assists " +
            robot.arms[static_cast<std::size_t>(robot.assistance->target)].name + " (" +
            std::string(nameOf(robot.assistance->pair.type)) + " contact)";
  }
  return {"cooperative", text, robot.warnings};
}

Summary summaryOf(const std::filesystem::path& file, const std::string& kind) {
  if (kind == "cooperative")
    return summarize(loadCooperative(file));
  if (kind == "experiment")
    return summarize(loadExperiment(file));
  if (kind == "deployment")
    return summarize(loadDeployment(file));
  if (kind == "hardware")
    return summarize(loadHardware(file));
  if (kind == "drive")
    return summarize(loadDriveProfile(file));
  if (kind == "path")
    return summarize(loadPath(file));
  if (kind == "trajectory")
    return summarize(loadTrajectory(file));
  return summarize(loadAnyRobot(file));
}

}  // namespace

Summary validate(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const std::string kind = document.kind();
  Summary summary = summaryOf(file, kind);
  document.check(tableOf(kind));
  for (const std::string& warning : document.warnings()) {
    if (std::ranges::find(summary.warnings, warning) == summary.warnings.end())
      summary.warnings.push_back(warning);
  }
  return summary;
}

}  // namespace tandem::config
