// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/axis_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace tandem::hal {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Samples of one motion in one direction.
struct Stroke {
  int direction = 0;
  std::vector<SweepSample> samples;
};

std::vector<Stroke> strokesOf(const std::vector<SweepSample>& samples) {
  std::vector<Stroke> strokes;
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const double step = samples[k].setpoint - samples[k - 1].setpoint;
    const int direction = (step > 0.0) - (step < 0.0);
    if (direction == 0)
      continue;
    if (strokes.empty() || strokes.back().direction != direction)
      strokes.push_back({direction, {}});
    strokes.back().samples.push_back(samples[k]);
  }
  return strokes;
}

/// A stroke without its first quarter, in which the free travel lies.
std::span<const SweepSample> loaded(const Stroke& stroke) {
  const std::size_t skipped = stroke.samples.size() / 4;
  return std::span(stroke.samples).subspan(skipped);
}

/// Slope of the least-squares line of the encoder's position over the drive's.
double ratioOf(std::span<const SweepSample> samples) {
  constexpr std::size_t kFewest = 5;
  if (samples.size() < kFewest)
    return kNone;
  double x = 0.0, y = 0.0;
  for (const SweepSample& s : samples) {
    x += s.position;
    y += s.position + s.encoder_difference;
  }
  const double n = static_cast<double>(samples.size());
  double xx = 0.0, xy = 0.0;
  for (const SweepSample& s : samples) {
    xx += (s.position - x / n) * (s.position - x / n);
    xy += (s.position - x / n) * (s.position + s.encoder_difference - y / n);
  }
  return xx > 0.0 ? xy / xx : kNone;
}

/// Mean difference of a direction between two positions.
double meanDifference(const std::vector<Stroke>& strokes, int direction, double least, double most) {
  double sum = 0.0;
  int count = 0;
  for (const Stroke& stroke : strokes) {
    if (stroke.direction != direction)
      continue;
    for (const SweepSample& s : loaded(stroke)) {
      if (s.position < least || s.position > most)
        continue;
      sum += s.encoder_difference;
      ++count;
    }
  }
  return count == 0 ? kNone : sum / count;
}

/// Positions that the loaded parts of a direction cover.
std::pair<double, double> rangeOf(const std::vector<Stroke>& strokes, int direction) {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Stroke& stroke : strokes) {
    if (stroke.direction != direction)
      continue;
    for (const SweepSample& s : loaded(stroke)) {
      least = std::min(least, s.position);
      most = std::max(most, s.position);
    }
  }
  return {least, most};
}

}  // namespace

SweepResult evaluateSweep(const std::vector<SweepSample>& samples) {
  SweepResult result{0.0, 0.0, 0.0, kNone, kNone};
  if (samples.empty())
    return result;
  const auto [least, most] = std::ranges::minmax(samples, {}, &SweepSample::position);
  result.travel = most.position - least.position;
  const std::vector<Stroke> strokes = strokesOf(samples);
  std::size_t moving = 0;
  double ratio = 0.0, weight = 0.0;
  for (const Stroke& stroke : strokes) {
    for (const SweepSample& s : stroke.samples) {
      result.following_max = std::max(result.following_max, std::abs(s.following_error));
      result.following_mean += std::abs(s.following_error);
      ++moving;
    }
    const auto part = loaded(stroke);
    if (const double slope = ratioOf(part); std::isfinite(slope)) {
      const double length = std::abs(part.back().position - part.front().position);
      ratio += length * slope;
      weight += length;
    }
  }
  if (moving > 0)
    result.following_mean /= static_cast<double>(moving);
  if (weight > 0.0)
    result.encoder_ratio = ratio / weight;
  const auto [up_least, up_most] = rangeOf(strokes, 1);
  const auto [down_least, down_most] = rangeOf(strokes, -1);
  const double from = std::max(up_least, down_least), to = std::min(up_most, down_most);
  result.backlash = std::abs(meanDifference(strokes, 1, from, to) - meanDifference(strokes, -1, from, to));
  return result;
}

}  // namespace tandem::hal
