// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/reach.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "config/translation_range.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

constexpr std::size_t kMostCells = std::size_t{1} << 30;

/// From [0, 1] to [0, 1], densely toward both ends.
double towardEnds(double u) { return 0.5 * (1.0 - std::cos(std::numbers::pi * u)); }

/// From [0, 1] to an angle, densely where two tubes bend alike or against each other.
double relativeAngle(double u) {
  const double half = u < 0.5 ? towardEnds(2.0 * u) - 1.0 : towardEnds(2.0 * u - 1.0);
  return std::numbers::pi * half;
}

/// From [0, 1] evenly to what a rotation may be, or to a full turn.
double angle(const safety::JointLimit& limit, double u) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const double upper =
      std::isinf(limit.upper) ? (std::isinf(limit.lower) ? 0.5 * kTurn : limit.lower + kTurn) : limit.upper;
  const double lower = std::isinf(limit.lower) ? upper - kTurn : limit.lower;
  return lower + u * (upper - lower);
}

/// The real root above one of x^(d+1) = x + 1.
double generalisedGoldenRatio(int d) {
  double x = 1.5;
  for (int i = 0; i < 100; ++i)
    x = std::pow(1.0 + x, 1.0 / (d + 1));
  return x;
}

}  // namespace

bool turnsFreely(const safety::ArmLimits& limits) {
  return std::all_of(
      limits.joints.begin() + limits.jointCount() / 2, limits.joints.end(),
      [](const safety::JointLimit& joint) { return std::isinf(joint.lower) && std::isinf(joint.upper); });
}

Eigen::MatrixXd sampleJoints(const safety::ArmLimits& limits, std::size_t count, std::uint64_t seed) {
  const config::TranslationRange range(limits);
  const int n = range.tubes();
  const bool free = turnsFreely(limits);
  const auto dimensions = static_cast<std::size_t>(free ? 2 * n - 1 : 2 * n);
  const double ratio = generalisedGoldenRatio(static_cast<int>(dimensions));
  std::mt19937_64 random(seed);
  std::vector<double> u(dimensions), step(dimensions);
  for (std::size_t k = 0; k < dimensions; ++k) {
    u[k] = static_cast<double>(random() >> 11) * 0x1p-53;
    step[k] = std::pow(ratio, -static_cast<double>(k + 1));
  }
  Eigen::MatrixXd samples = Eigen::MatrixXd::Zero(2 * n, static_cast<Eigen::Index>(count));
  for (Eigen::Index sample = 0; sample < samples.cols(); ++sample) {
    auto q = samples.col(sample);
    std::size_t k = 0;
    for (int i = 0; i < n; ++i, ++k) {
      const auto [lower, upper] = range.of(i, i == 0 ? 0.0 : q[i - 1]);
      q[i] = lower + towardEnds(u[k]) * (upper - lower);
    }
    for (int i = free ? 1 : 0; i < n; ++i, ++k)
      q[n + i] = free ? relativeAngle(u[k]) : angle(limits.joints[n + i], u[k]);
    for (k = 0; k < dimensions; ++k) {
      u[k] += step[k];
      u[k] -= std::floor(u[k]);
    }
  }
  return samples;
}

Cells::Cells(const Points& points, bool symmetric, double size, std::size_t samples)
    : symmetric_(symmetric), size_(size) {
  constexpr auto kLargest = std::numeric_limits<std::int64_t>::max();
  Index upper;
  lower_.fill(kLargest);
  upper.fill(-kLargest);
  bool any = false;
  for (const auto& [sample, place] : points) {
    if (sample >= samples)
      continue;
    any = true;
    const Index index = indexOf(place);
    for (std::size_t k = 0; k < 3; ++k) {
      lower_[k] = std::min(lower_[k], index[k]);
      upper[k] = std::max(upper[k], index[k]);
    }
  }
  if (!any) {
    lower_.fill(0);
    return;
  }
  double cells = 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    count_[k] = upper[k] - lower_[k] + 1;
    cells *= static_cast<double>(count_[k]);
  }
  if (cells > static_cast<double>(kMostCells))
    throw Failure(kUsage, "--voxel: too small for memory, expected a larger one");
  filled_.assign(static_cast<std::size_t>(cells), 0);
  for (const auto& [sample, place] : points) {
    if (sample < samples)
      filled_[flat(indexOf(place))] = 1;
  }
}

/// x, y, z of a cube; radius, 0, z of a ring.
Cells::Index Cells::indexOf(const Eigen::Vector3d& place) const {
  const auto cell = [this](double x) { return static_cast<std::int64_t>(std::floor(x / size_)); };
  if (symmetric_)
    return {cell(std::hypot(place.x(), place.y())), 0, cell(place.z())};
  return {cell(place.x()), cell(place.y()), cell(place.z())};
}

std::size_t Cells::flat(const Index& index) const {
  std::int64_t at = 0;
  for (std::size_t k = 0; k < 3; ++k)
    at = at * count_[k] + (index[k] - lower_[k]);
  return static_cast<std::size_t>(at);
}

double Cells::volume() const {
  const double cube = size_ * size_ * size_;
  double cells = 0.0;
  const auto layer = static_cast<std::size_t>(count_[1] * count_[2]);
  for (std::size_t i = 0; i < filled_.size(); ++i) {
    if (filled_[i] != 0) {
      const std::size_t slice = i / layer;
      const double ring = static_cast<double>(lower_[0]) + static_cast<double>(slice);
      cells += symmetric_ ? std::numbers::pi * (2.0 * ring + 1.0) : 1.0;
    }
  }
  return cells * cube;
}

bool Cells::contains(const Eigen::Vector3d& place) const {
  const Index index = indexOf(place);
  for (std::size_t k = 0; k < 3; ++k) {
    if (index[k] < lower_[k] || index[k] >= lower_[k] + count_[k])
      return false;
  }
  return filled_[flat(index)] != 0;
}

std::array<Eigen::Vector3d, 8> Cells::corners() const {
  std::array<Eigen::Vector3d, 8> all;
  for (std::size_t c = 0; c < all.size(); ++c) {
    for (std::size_t k = 0; k < 3; ++k) {
      const bool far = ((c >> k) & 1u) != 0;
      const double low = static_cast<double>(lower_[k]), high = static_cast<double>(lower_[k] + count_[k]);
      const double radius = static_cast<double>(lower_[0] + count_[0]);
      all[c][static_cast<Eigen::Index>(k)] = size_ * (symmetric_ && k < 2 ? (far ? radius : -radius)
                                                      : far               ? high
                                                                          : low);
    }
  }
  return all;
}

SharedVolume sharedVolume(const std::vector<Cells>& arms, const std::vector<Eigen::Isometry3d>& bases, double size) {
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  std::vector<Eigen::Isometry3d> to_arm;
  for (std::size_t k = 0; k < arms.size(); ++k) {
    for (const Eigen::Vector3d& corner : arms[k].corners()) {
      lower = lower.cwiseMin(bases[k] * corner);
      upper = upper.cwiseMax(bases[k] * corner);
    }
    to_arm.push_back(bases[k].inverse());
  }
  std::array<std::int64_t, 3> first{}, last{};
  for (int k = 0; k < 3; ++k) {
    first[k] = static_cast<std::int64_t>(std::floor(lower[k] / size));
    last[k] = static_cast<std::int64_t>(std::ceil(upper[k] / size));
  }
  SharedVolume volume;
  const double cube = size * size * size;
  const auto centre = [size](std::int64_t i) { return (static_cast<double>(i) + 0.5) * size; };
  for (std::int64_t x = first[0]; x < last[0]; ++x) {
    for (std::int64_t y = first[1]; y < last[1]; ++y) {
      for (std::int64_t z = first[2]; z < last[2]; ++z) {
        const Eigen::Vector3d place(centre(x), centre(y), centre(z));
        std::size_t inside = 0;
        for (std::size_t k = 0; k < arms.size(); ++k)
          inside += arms[k].contains(to_arm[k] * place) ? 1 : 0;
        volume.any += inside > 0 ? cube : 0.0;
        volume.common += inside == arms.size() ? cube : 0.0;
      }
    }
  }
  return volume;
}

}  // namespace tandem::cli
