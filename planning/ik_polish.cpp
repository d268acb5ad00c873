// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <random>

#include "planning/detail/ik_search.h"

namespace tandem::planning {
namespace {

/// Whether joints satisfy all constraints of a problem, up to rounding.
bool kept(const PosePoint& point) {
  constexpr double kRounding = 1e-9;
  return point.answered && ((point.constraints - point.lower).array() >= -kRounding).all() &&
         ((point.upper - point.constraints).array() >= -kRounding).all();
}

}  // namespace

/** Random descent steps of all sizes down to 1e-7 of the range: half of them towards any joints inside the limits, half
 * of them with a few joints of one arm, projected inside. The model's derivatives jump where ends of tubes pass each
 * other; a gradient method stops there before the nearest pose. */
safety::RobotVector InverseKinematics::downhill(const PoseProblem& problem,
                                                const safety::RobotVector& q,
                                                std::mt19937_64& engine) const {
  constexpr int kMostWithoutGain = 2500, kMost = 20000;
  constexpr double kGain = 1e-12, kSmallest = -7.0;
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> normal;
  safety::RobotVector best = q;
  double least = evaluate(problem, q).objective;
  for (int i = 0, since = 0; i < kMost && since < kMostWithoutGain && !cancelled(); ++i, ++since) {
    const int arm = static_cast<int>(engine() % static_cast<std::uint64_t>(arms_.count()));
    const int first = arms_.offset(arm), size = arms_.size(arm);
    const JointSampler& sampler = samplers_[static_cast<std::size_t>(arm)];
    const safety::ArmVector own = best.segment(first, size);
    const double step = std::pow(10.0, kSmallest * unit(engine));
    safety::ArmVector moved = own;
    if (i % 2 == 0) {
      moved += step * (sampler.random(engine) - own);
    } else {
      for (int j = 0; j < size; ++j) {
        if (unit(engine) < 0.5)
          moved[j] += step * PoseProblem::unit(arms_, first + j) * normal(engine);
      }
      moved = sampler.inside(moved);
    }
    safety::RobotVector candidate = best;
    candidate.segment(first, size) = moved;
    const PosePoint point = evaluate(problem, candidate);
    if (!kept(point) || point.objective >= least - kGain * std::max(1.0, least))
      continue;
    least = point.objective;
    best = candidate;
    since = 0;
  }
  return best;
}

/// Solves for the nearest pose again from itself: an interior-point method may stop before a corner of the limits, or
/// before a point where the model's derivatives jump.
void InverseKinematics::polish(Search& search, std::mt19937_64& engine) const {
  constexpr int kRounds = 3;
  constexpr double kAside = 5e-3;       // rad
  constexpr double kWorthwhile = 1e-8;  // m
  for (int i = 0; i < kRounds && !search.reached && !cancelled(); ++i) {
    improve(search, neighbour(search.best.q, kAside * i, engine));
    if (search.reached || search.nearest_problem.keep_relative)
      continue;
    const double before = search.best.largestError();
    PoseSolution lower = search.nearest;
    lower.q = downhill(search.nearest_problem, search.best.q, engine);
    take(search, search.nearest_problem, lower);
    if (search.reached || search.best.largestError() > before - kWorthwhile)
      continue;
    improve(search, neighbour(search.best.q, 0.0, engine));  // its multipliers identify the active limits
  }
}

}  // namespace tandem::planning
