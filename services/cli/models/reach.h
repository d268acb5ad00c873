// SPDX-License-Identifier: Apache-2.0
/** @file Reachable space: evenly distributed joint vectors, and the volume of the cells that their tips occupy. */
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "safety/limits.h"

namespace tandem::cli {

/// Whether all rotations are free: what the tip reaches is then a solid of revolution about the base's z axis.
bool turnsFreely(const safety::ArmLimits& limits);

/** Joint vectors inside the limits, a column each, m and rad: the additive recurrence with the generalised golden ratio
 * (Roberts 2018), shifted by the seed. Translations are spread over what the tube before leaves, more densely toward
 * both ends, where the edges of the reachable space are. Where all rotations are free, tube 1 stays at zero, as turning
 * all tubes alike turns the arm, and the others lie more densely where they bend with it or against it. */
Eigen::MatrixXd sampleJoints(const safety::ArmLimits& limits, std::size_t count, std::uint64_t seed);

/** Cells of one size that points fall into: cubes, or rings about z for a solid of revolution. */
class Cells {
 public:
  using Points = std::vector<std::pair<std::size_t, Eigen::Vector3d>>;  ///< sample number and place, arm base frame, m

  /// @param samples  only sample numbers below count
  /// @throw Failure where there would be too many cells.
  Cells(const Points& points, bool symmetric, double size, std::size_t samples);

  /// Volume of all cells with a point in them, m^3.
  double volume() const;
  /// Whether a place is in such a cell. m, arm base frame.
  bool contains(const Eigen::Vector3d& place) const;
  /// Corners of the box around all cells, m, arm base frame; a point without cells.
  std::array<Eigen::Vector3d, 8> corners() const;

 private:
  using Index = std::array<std::int64_t, 3>;
  Index indexOf(const Eigen::Vector3d& place) const;
  std::size_t flat(const Index& index) const;

  bool symmetric_;
  double size_;
  Index lower_{}, count_{};  ///< first cell and number of cells along each axis
  std::vector<std::uint8_t> filled_;
};

struct SharedVolume {
  double common = 0.0;  ///< in every arm's cells, m^3
  double any = 0.0;     ///< in some arm's cells, m^3
};

/// Counts cubes of `size` (m) by their centres. @param bases  robot base frame <- arm base frame, for each arm
SharedVolume sharedVolume(const std::vector<Cells>& arms, const std::vector<Eigen::Isometry3d>& bases, double size);

}  // namespace tandem::cli
