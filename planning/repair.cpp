// SPDX-License-Identifier: Apache-2.0
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "planning/detail/index.h"
#include "planning/feasibility.h"

namespace tandem::planning {
namespace {

using Eigen::Vector3d;

/// min_s sum w_k |s_k - d_k|^2 + mu sum |second differences|^2; the correction of the start is zero.
std::vector<Vector3d> smooth(const std::vector<Vector3d>& d, const std::vector<double>& w, double mu) {
  const int n = static_cast<int>(d.size());
  using Triplet = Eigen::Triplet<double>;
  std::vector<Triplet> entries;
  Eigen::MatrixXd right(n, 3);
  for (int k = 0; k < n; ++k) {
    entries.emplace_back(k, k, w[at(k)]);
    right.row(k) = w[at(k)] * d[at(k)].transpose();
  }
  constexpr double kPattern[] = {1.0, -2.0, 1.0};
  for (int k = 0; k + 1 < n; ++k) {  // around point k; point -1 is the start, whose correction is zero
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (k - 1 + i >= 0 && k - 1 + j >= 0)
          entries.emplace_back(k - 1 + i, k - 1 + j, mu * kPattern[i] * kPattern[j]);
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::MatrixXd s = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
  std::vector<Vector3d> result;
  for (int k = 0; k < n; ++k)
    result.push_back(s.row(k).transpose());
  return result;
}

}  // namespace

RepairResult repairTrajectory(const Arms& arms,
                              const TrajectorySpec& spec,
                              const safety::RobotVector& start,
                              const FeasibilityOptions& options,
                              double smoothing) {
  constexpr int kRounds = 8, kSmoothRounds = 2;
  constexpr double kMoved = 100.0;
  RepairResult result;
  result.spec = spec;
  result.before = result.after = checkTrajectory(arms, spec, start, options);
  std::vector<Vector3d> wanted;
  for (const PointReport& point : result.before.points)
    wanted.push_back(point.wanted.tip);
  for (; result.rounds < kRounds && !result.after.feasible && !result.after.cancelled && result.after.start.empty();
       ++result.rounds) {
    std::vector<Vector3d> correction;
    std::vector<double> weight;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      const PointReport& point = result.after.points[k];
      correction.push_back((point.reach == Reach::kReached ? point.wanted.tip : point.tip) - wanted[k]);
      weight.push_back(correction.back().norm() > options.accept ? kMoved : 1.0);
    }
    if (result.rounds < kSmoothRounds && smoothing > 0.0)
      correction = smooth(correction, weight, smoothing);
    Waypoints moved;
    moved.absolute = true;
    for (std::size_t k = 0; k < wanted.size(); ++k)
      moved.points.push_back(wanted[k] + correction[k]);
    result.spec.shape = moved;
    result.after = checkTrajectory(arms, result.spec, start, options);
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < std::min(wanted.size(), result.after.points.size()); ++k) {
    const double change = (result.after.points[k].wanted.tip - wanted[k]).norm();
    result.largest_change = std::max(result.largest_change, change);
    sum += change * change;
  }
  result.rms_change = wanted.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(wanted.size()));
  return result;
}

}  // namespace tandem::planning
