// SPDX-License-Identifier: Apache-2.0
#include "services/console/markers.h"

#include <algorithm>
#include <array>
#include <chrono>

namespace tandem::console {
namespace {

constexpr std::int32_t kLineStrip = 4, kSphereList = 7;
constexpr std::int64_t kLifetime = 1'000'000'000;  // ns; several periods of the shapes
/// Okabe and Ito's palette, which colour-blind people tell apart; tube 1 is the innermost.
constexpr std::array<std::array<float, 4>, 4> kColors{{{0.90f, 0.62f, 0.00f, 1.0f},
                                                       {0.34f, 0.71f, 0.91f, 1.0f},
                                                       {0.00f, 0.62f, 0.45f, 1.0f},
                                                       {0.80f, 0.47f, 0.65f, 1.0f}}};

std::array<double, 3> pointOf(const dds::Shape& shape, std::size_t i) {
  return {shape.points[3 * i], shape.points[3 * i + 1], shape.points[3 * i + 2]};
}

dds::Marker marker(const dds::Shape& shape, const std::string& arm, std::int64_t stamp, std::size_t point) {
  dds::Marker marker;
  marker.stamp = stamp;
  marker.frame = shape.frame;
  marker.group = arm;
  marker.lifetime = kLifetime;
  marker.color = kColors[(std::max<std::size_t>(shape.tubes[point], 1) - 1) % kColors.size()];
  marker.scale = {2.0 * shape.outer_radius[point], 0.0, 0.0};
  return marker;
}

std::int64_t wallClock() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

}  // namespace

dds::MarkerArray markersOf(const dds::Shape& shape, const std::string& arm, std::int64_t stamp) {
  dds::MarkerArray array;
  const std::size_t count = shape.tubes.size();
  if (count == 0)
    return array;
  for (std::size_t i = 0; i < count; ++i) {
    if (i == 0 || shape.tubes[i] != shape.tubes[i - 1]) {
      dds::Marker line = marker(shape, arm, stamp, i);
      line.id = static_cast<std::int32_t>(array.markers.size());
      line.type = kLineStrip;
      // Stretches touch: each begins where the one before it ended.
      if (i > 0)
        line.points.push_back(pointOf(shape, i - 1));
      array.markers.push_back(std::move(line));
    }
    array.markers.back().points.push_back(pointOf(shape, i));
  }
  dds::Marker tip = marker(shape, arm, stamp, count - 1);
  tip.id = static_cast<std::int32_t>(array.markers.size());
  tip.type = kSphereList;
  tip.scale.fill(3.0 * shape.outer_radius[count - 1]);
  tip.points.push_back(pointOf(shape, count - 1));
  array.markers.push_back(std::move(tip));
  return array;
}

Markers::Markers(dds::Bus& bus, std::vector<std::string> arms)
    : bus_(bus), arms_(std::move(arms)), writer_(bus.writer(dds::kMarkers)) {}

void Markers::look() {
  const bool wanted = writer_.matched() > 0;
  if (wanted == active())
    return;
  shapes_.clear();
  for (const std::string& arm : wanted ? arms_ : std::vector<std::string>{})
    shapes_.push_back(bus_.reader(
        dds::kShape, arm, [this, arm](const dds::Shape& shape) { writer_.write(markersOf(shape, arm, wallClock())); }));
}

}  // namespace tandem::console
