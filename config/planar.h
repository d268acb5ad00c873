// SPDX-License-Identifier: Apache-2.0
/** @file Robot files of planar arms: the example type of docs/own-robot-type.md. */
#pragma once

#include <vector>

#include "config/config.h"

namespace tandem::config {

class Map;
struct Mapping;

/** One rigid link. */
struct PlanarLink {
  double length = 0.0;    ///< m
  double diameter = 0.0;  ///< m
};

/** Links in the x-y plane of the base, each rotated about z by its joint; at 0 they all lie along x. */
struct PlanarArm {
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();  ///< robot base frame <- arm base frame
  std::vector<PlanarLink> links;
};

struct PlanarRobot : TypeData {
  std::vector<PlanarArm> arms;  ///< in the order of Robot::arms
};

const Mapping& planarTable();

/// @throw Error that names file, line, key, what was found and what was expected.
Robot loadPlanarRobot(const std::filesystem::path& file);

/// Refuses values of a deployment that planar arms do not support. @throw Error at the key.
void checkPlanarDeployment(const Map& map, const Deployment& deployment);

}  // namespace tandem::config
