// SPDX-License-Identifier: Apache-2.0
/** @file Visualization markers of arms and grasped object, for RViz, Foxglove and Lichtblick. */
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "robots/appearance.h"
#include "services/dds/bus.h"

namespace tandem::console {

/// One arm: a line strip for every segment with the same outermost tube, as wide as the tube, and a sphere at the tip.
/// Markers expire unless they are replaced.
/// @param stamp  ns since the epoch
/// @param stamp  ns since the epoch
dds::MarkerArray markersOf(const dds::Shape& shape, const std::string& arm, std::int64_t stamp);

/// A grasped object: a cube of its size.
/// @param pose  robot base frame <- object  @param stamp  ns since the epoch
dds::MarkerArray markersOf(const config::GraspedObject& object,
                           const Eigen::Isometry3d& pose,
                           const std::string& frame,
                           std::int64_t stamp);

/** Publishes the markers of all arms and of the grasped object while there are subscribers; without them it reads
 * nothing. */
class Markers {
 public:
  Markers(dds::Bus& bus, const config::Robot& robot);

  /// Starts or stops reading, as subscribers appear or disappear. Called periodically, on one thread.
  void look();
  bool active() const { return !shapes_.empty(); }

 private:
  void moved(std::size_t arm, const dds::PoseStamped& tip);

  dds::Bus& bus_;
  std::vector<std::string> arms_;
  std::optional<config::GraspedObject> object_;
  std::mutex mutex_;
  std::vector<std::optional<Eigen::Isometry3d>> tips_;  ///< of the arms that grasp it
  dds::Writer<dds::MarkerArray> writer_;
  std::vector<dds::Reader> shapes_, poses_;
};

}  // namespace tandem::console
