// SPDX-License-Identifier: Apache-2.0
/** @file The arms as markers: what RViz, Foxglove and Lichtblick draw without knowing of Tandem. */
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "services/dds/bus.h"

namespace tandem::console {

/// One arm: a line strip for every stretch with the same outermost tube, as wide as the tube, and a sphere at the tip.
/// They vanish by themselves when no new ones come.
/// @param stamp  ns since the epoch
dds::MarkerArray markersOf(const dds::Shape& shape, const std::string& arm, std::int64_t stamp);

/** Publishes the markers of all arms as long as somebody listens; otherwise it reads nothing either. */
class Markers {
 public:
  Markers(dds::Bus& bus, std::vector<std::string> arms);

  /// Begins or ends, as listeners have come or gone. Now and then, on one thread.
  void look();
  bool active() const { return !shapes_.empty(); }

 private:
  dds::Bus& bus_;
  std::vector<std::string> arms_;
  dds::Writer<dds::MarkerArray> writer_;
  std::vector<dds::Reader> shapes_;
};

}  // namespace tandem::console
