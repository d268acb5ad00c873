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

/** An arm, as markers show it. */
struct MarkedArm {
  std::string name;
  int index = 0;  ///< among the robot's arms
  int tubes = 0;
};

/// One arm in the colours of palette.h: a line strip for every segment with the same outermost tube, as wide as the
/// tube, and a sphere at the tip. Markers expire unless they are replaced.
/// @param stamp  ns since the epoch
dds::MarkerArray markersOf(const dds::Shape& shape, const MarkedArm& arm, std::int64_t stamp);

/// The frame of a tip: lines along x (red), y (green) and z (blue). @param arm  its name
dds::MarkerArray tipMarkersOf(const dds::PoseStamped& tip, const std::string& arm);

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
  void moveObject(std::size_t arm, const dds::PoseStamped& tip);

  dds::Bus& bus_;
  std::vector<MarkedArm> arms_;
  std::optional<config::GraspedObject> object_;
  std::mutex mutex_;
  std::vector<std::optional<Eigen::Isometry3d>> tips_;  ///< of the arms that grasp it
  dds::Writer<dds::MarkerArray> writer_;
  std::vector<dds::Reader> shapes_, poses_;
};

}  // namespace tandem::console
