// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the file loaders. */
#pragma once

#include <filesystem>
#include <string>

#include "config/config.h"
#include "config/detail/yaml_reader.h"

namespace tandem::config {

/// The whole file. @throw Error 0:0 where it cannot be read.
std::string readFile(const std::filesystem::path& file);

/// A preset in the search folders only, never a path. @throw Error that lists the presets there are.
std::filesystem::path findPreset(const std::string& name, const std::string& kind);

/// The `robot` key: relative to the folder of the file, else a preset. @throw Error at the key.
std::filesystem::path robotPath(const Map& map, const std::filesystem::path& file);

/// A key that names another file, `robot` or `hardware`, in the same way.
/// @param kind  of presets, as findFile() takes it; empty: the key says it
std::filesystem::path companionPath(const Map& map,
                                    const std::string& key,
                                    const std::filesystem::path& file,
                                    const std::string& kind = {});

/// The `method_library` key: relative to the folder of the file; empty without it. Whether it is there is seen when it
/// is loaded: with several hosts it has to be on some alone.
/// @param needed  the method `foreign` is named under `key`  @throw Error at `key` where the library is missing
std::filesystem::path methodLibrary(const Map& map,
                                    const std::filesystem::path& file,
                                    bool needed,
                                    const std::string& key);

/// [beta_1..beta_n, alpha_1..alpha_n] from the keys `beta` and `alpha`, inside the limits.
/// @throw Error at the element that is outside.
Eigen::VectorXd readJoints(const Map& map, const safety::ArmLimits& limits);

/// R = Rz(yaw) Ry(pitch) Rx(roll), and a position.
Eigen::Isometry3d readPose(const Map& map);

/// @throw Error where a wall has its inner diameter at or above its outer one.
void checkWall(const Map& map, double outer, double inner);

/// @throw Error at an arm of the name `pair`.
void refusePair(const Map& arm);

/// The `plant` of a deployment. @param robot_file read where the plant names arms.
/// @throw Error at the value that names an arm or tube that there is not, or at a load on a rigid plant.
sim::PlantOptions readPlant(const Map& map, const std::filesystem::path& robot_file);

/// The `teleoperation` of a deployment. @throw Error at a name used twice, an empty box, a normal of no length.
Teleoperation readTeleoperation(const Map& map);

/// A trajectory without its `tandem` line. @param folder that CSV paths start from; empty: CSV files are refused.
planning::TrajectorySpec readTrajectory(const Map& map, const std::filesystem::path& folder);

/// Points of a CSV file: lines `x,y,z` in m. @throw Error that names FILE:LINE.
std::vector<Eigen::Vector3d> readPoints(const std::filesystem::path& file);

}  // namespace tandem::config
