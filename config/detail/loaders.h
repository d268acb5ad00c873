// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the file loaders. */
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "config/config.h"
#include "config/detail/yaml_reader.h"

namespace tandem::config {

/// Content of a file. @throw Error 0:0 if it cannot be read.
std::string readFile(const std::filesystem::path& file);

/// Finds a preset in the search folders only, never a path. @throw Error that lists the available presets.
std::filesystem::path findPreset(const std::string& name, const std::string& kind);

/// Path in the `robot` key: relative to the folder of the file, else a preset. @throw Error at the key.
std::filesystem::path robotPath(const Map& map, const std::filesystem::path& file);

/// Path in a key that names another file, `robot` or `hardware`, with the same rule.
/// @param kind of presets, as for findFile(); empty: that of the key
std::filesystem::path companionPath(const Map& map,
                                    const std::string& key,
                                    const std::filesystem::path& file,
                                    const std::string& kind = {});

/// Path in the `method_library` key: relative to the folder of the file; empty without it. The existence of the file is
/// checked when the library is loaded: with several hosts only some of them need it.
/// @param needed the method `foreign` is named under `key` @throw Error at `key` if the library is missing
std::filesystem::path methodLibrary(const Map& map,
                                    const std::filesystem::path& file,
                                    bool needed,
                                    const std::string& key);

/// [beta_1..beta_n, alpha_1..alpha_n] from the keys `beta` and `alpha`, inside the limits.
/// @throw Error at the element that is outside.
Eigen::VectorXd readJoints(const Map& map, const safety::ArmLimits& limits);

/// R = Rz(yaw) Ry(pitch) Rx(roll), and a position.
Eigen::Isometry3d readPose(const Map& map);

/// @throw Error if the inner diameter of a wall is not less than its outer one.
void checkWall(const Map& map, double outer, double inner);

/// Reads the list `arms` of a robot. @throw Error with the errors of all arms, of a name used twice, of the name `pair`
void readArms(const Map& map, const std::function<void(const Map&)>& read);

/// Reads the `plant` of a deployment. @param robot called if the plant names arms.
/// @throw Error at the value that names an arm or tube that does not exist, or at a load on a rigid plant.
sim::PlantOptions readPlant(const Map& map, const std::function<Robot()>& robot);

/// Reads the `teleoperation` of a deployment. @throw Error at a name used twice, an empty box, a normal of zero length.
Teleoperation readTeleoperation(const Map& map);

/** A task beside the tip and the relative position; arms by name, letter or index. */
struct TrajectoryFurther {
  std::string arm;
  std::vector<std::string> arms;  ///< of kinds with two arms
  planning::Heading desired = planning::Heading::kStart;
  std::vector<planning::HeadingWaypoint> waypoints;
  Eigen::Vector3d target = Eigen::Vector3d::Zero();            ///< m
  double distance = 0.0;                                       ///< d of soft tasks, m or a stability
  double tolerance = std::numeric_limits<double>::infinity();  ///< m, rad or a stability
};

/** One of the `tasks` of a trajectory; arms by name, letter or index. */
struct TrajectoryTask {
  std::string tip;
  std::vector<std::string> relative;
  std::optional<TrajectoryFurther> axis, orientation, relative_orientation, look_at, remote_centre, pose, relative_pose,
      follow_the_leader, joint_limits, elastic_stability;
};

/// Reads `tasks`, of which `arm` and `other_arm` are the short form.
void readTasks(const Map& map, planning::TrajectorySpec& spec);

/// Reads a trajectory without its `tandem` key. @param folder base of CSV paths; empty: CSV files are refused.
planning::TrajectorySpec readTrajectory(const Map& map, const std::filesystem::path& folder);

/// Reads the points of a CSV file: lines `x,y,z` in m. @throw Error that names FILE:LINE.
std::vector<Eigen::Vector3d> readPoints(const std::filesystem::path& file);

}  // namespace tandem::config
