// SPDX-License-Identifier: Apache-2.0
#include "bench/joint_paths.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace tandem::bench {
namespace {

using kinematics::ConcentricTubeArm;

ConcentricTubeArm makeArm(double poisson_ratio, double outer_od, double outer_id, const double (&length)[3]) {
  ConcentricTubeArm arm;
  arm.tubes = {{1.524e-3, 1.3e-3, 58e9, poisson_ratio, {}},
               {1.8e-3, 1.62e-3, 58e9, poisson_ratio, {}},
               {outer_od, outer_id, 58e9, poisson_ratio, {}}};
  constexpr double kCurvature[] = {10.0, 5.0, 7.0}, kCurved = 0.05;
  for (int i = 0; i < 3; ++i) {
    arm.tubes[i].addSection(length[i] - kCurved, 0.0);
    arm.tubes[i].addSection(kCurved, kCurvature[i]);
  }
  return arm;
}

}  // namespace

ConcentricTubeArm arkArm() { return makeArm(0.6, 2.164e-3, 2.0e-3, {0.437, 0.317, 0.199}); }
ConcentricTubeArm arkArm(int tubes) {
  ConcentricTubeArm arm = arkArm();
  if (tubes == 2)
    arm.tubes.pop_back();
  if (tubes == 4) {
    kinematics::Tube& outer = arm.tubes.emplace_back(kinematics::Tube{2.8e-3, 2.4e-3, 58e9, 0.6, {}});
    outer.addSection(0.07, 0.0);
    outer.addSection(0.05, 4.0);
  }
  return arm;
}
ConcentricTubeArm timcArm() { return makeArm(0.3, 2.35e-3, 2.06e-3, {0.463, 0.3305, 0.199}); }

bool overlapping(const ConcentricTubeArm& arm, const Eigen::VectorXd& q) {
  for (int i = 0; i < arm.tubeCount(); ++i) {
    for (int j = 0; j < i; ++j) {
      const double end = std::min(q[i] + arm.tubes[i].length(), q[j] + arm.tubes[j].length());
      const double begin = std::max({0.0, q[i] + arm.tubes[i].length() - arm.tubes[i].sections.back().length,
                                     q[j] + arm.tubes[j].length() - arm.tubes[j].sections.back().length});
      if (end > begin + 1e-3)
        return true;
    }
  }
  return false;
}

std::vector<Eigen::VectorXd> randomJoints(const ConcentricTubeArm& arm, bool overlap, int count, std::uint32_t seed) {
  std::mt19937 engine(seed);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(engine); };
  const int n = arm.tubeCount();
  std::vector<Eigen::VectorXd> result;
  while (static_cast<int>(result.size()) < count) {
    Eigen::VectorXd q(2 * n);
    double end = arm.tubes[0].length();
    for (int i = 0; i < n; ++i) {
      const double length = arm.tubes[i].length();
      end = uniform(0.01, std::min(end, length));
      q[i] = end - length;
      q[n + i] = uniform(-std::numbers::pi, std::numbers::pi);
    }
    if (overlapping(arm, q) == overlap)
      result.push_back(q);
  }
  return result;
}

std::vector<Eigen::VectorXd> controlPath(const ConcentricTubeArm& arm,
                                         bool overlap,
                                         double period,
                                         int count,
                                         std::uint32_t seed) {
  const int n = arm.tubeCount();
  for (;; ++seed) {
    const Eigen::VectorXd start = randomJoints(arm, overlap, 1, seed).front();
    std::vector<Eigen::VectorXd> path;
    bool inside = true;
    for (int k = 0; k < count && inside; ++k) {
      Eigen::VectorXd q = start;
      for (int i = 0; i < n; ++i) {
        const double phase = 2.0 * std::numbers::pi * 0.1 * period * k;
        q[i] += 5e-3 * std::sin(phase + i);
        q[n + i] += 0.2 * std::sin(phase + 2.0 * i);
        inside = inside && q[i] < 0.0 &&
                 (i == 0 || q[i] + arm.tubes[i].length() < q[i - 1] + arm.tubes[i - 1].length()) &&
                 q[i] + arm.tubes[i].length() > 0.0;
      }
      path.push_back(q);
    }
    if (inside)
      return path;
  }
}

}  // namespace tandem::bench
