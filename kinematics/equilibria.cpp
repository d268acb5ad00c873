// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "kinematics/compliant_model.h"
#include "kinematics/detail/arc_length.h"
#include "kinematics/gauss_legendre.h"

namespace tandem::kinematics {
namespace {

constexpr double kFullAngle = 2.0 * std::numbers::pi;
constexpr double kSame = 1e-5;  ///< largest difference of end angles of one equilibrium, rad

/// Elastic energy by quadrature over the shape, J.
double energyOf(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q, const TubeVector& theta) {
  constexpr int kPieces = 4;
  constexpr double kSliver = 1e-9;  // ends that meet up to rounding, m
  const GaussLegendre& rule = GaussLegendre::rule(8);
  std::vector<ShapePoint> points;
  std::vector<double> weights;
  std::vector<int> intervals;
  for (int k = 0; k < parts.count; ++k) {
    const double start = parts.interval[k].start, piece = (parts.interval[k].end - start) / kPieces;
    for (int j = 0; j < kPieces * rule.count && piece > kSliver; ++j) {
      const int before = j / rule.count;
      points.emplace_back().s = start + piece * (before + rule.node[j % rule.count]);
      weights.push_back(piece * rule.weight[j % rule.count]);
      intervals.push_back(k);
    }
  }
  const TubeJoints joints(q);
  const EndAngleSweep<double> sweep(arm, parts, joints.beta, theta, 1.0, StepDepth::kPose, points);
  double energy = 0.0;
  for (std::size_t j = 0; j < points.size(); ++j) {
    const Segmentation::Interval& interval = parts.interval[intervals[j]];
    for (int i = 0; i < arm.tubeCount(); ++i) {
      if (interval.section[i] == Segmentation::kAbsent)
        continue;
      const TubeSection& section = arm.tubes[i].sections[interval.section[i]];
      const Eigen::Vector2d own =
          section.curvature * Eigen::Vector2d(-std::sin(points[j].psi[i]), std::cos(points[j].psi[i]));
      energy += weights[j] * (0.5 * section.bending_stiffness * (points[j].curvature - own).squaredNorm() +
                              0.5 * points[j].moment[i] * points[j].moment[i] / section.torsional_stiffness);
    }
  }
  // Behind the entry point a tube's moment is constant: t F t / 2; t F is the twist there.
  TubeVector twist = sweep.entryAngle() - sweep.baseAngle();
  for (int i = 0; i < arm.tubeCount(); ++i)
    twist[i] -= arm.tubes[i].helixAngle(-q[i]);
  return energy + 0.5 * sweep.entryMoment().dot(twist);
}

/** Collects equilibria at q. A motor may differ by full turns: the tube's end then differs by the same turns. */
class Search {
 public:
  Search(const ConcentricTubeArm& arm, const Equilibrium& equilibrium, const JointsRef& q)
      : arm_(arm), equilibrium_(equilibrium), q_(q), joints_(q) {
    segment(arm_, q_, parts_);
  }

  const std::vector<TubeVector>& found() const { return found_; }

  /// Adds the solution of Newton's method from here, if it converges.
  void tryFrom(const TubeVector& theta, double longest) {
    Equilibrium::Root root;
    root.theta = theta;
    int conjugate_points = 0;
    if (!equilibrium_.correct(parts_, q_, 1.0, longest, root, conjugate_points))
      return;
    const bool known = std::any_of(found_.begin(), found_.end(), [&](const TubeVector& other) {
      return (other - root.theta).cwiseAbs().maxCoeff() < kSame;
    });
    if (!known)
      found_.push_back(root.theta);
  }

  /// Newton's method from a grid of end angles over two turns of every tube except the first.
  void scan(int across) {
    constexpr double kLongestFix = 2.0;
    int starts = 1;
    for (int i = 1; i < arm_.tubeCount(); ++i)
      starts *= across;
    for (int start = 0; start < starts; ++start) {
      TubeVector theta = untwistedEnds(arm_, parts_, q_);
      for (int i = 1, rest = start; i < arm_.tubeCount(); ++i, rest /= across)
        theta[i] += kFullAngle * (2.0 * (rest % across) / across - 1.0);
      tryFrom(theta, kLongestFix);
    }
  }

  /// Rotates one motor from an equilibrium, around all folds, up to a full turn or the start of a closed curve;
  /// collects the equilibria at full turns.
  void turn(const TubeVector& theta, int tube, double sense) {
    const Point start{theta};
    const auto system = [&](const Point& point, double lambda, auto& matrix) -> TubeVector {
      const Equilibrium::Sweep sweep(arm_, parts_, joints_.beta, point.theta, 1.0, StepDepth::kAngles);
      const TubeVector turned = TubeVector::Unit(tube);
      matrix.template topRows<kMaxTubes>() << sweep.baseByEnd(), -turned;
      return sweep.baseAngle() - joints_.alpha - lambda * turned;
    };
    const auto visit = [&](const Point& before, double lambda, const Point& after, double next) {
      constexpr double kLongestFix = 0.5;
      for (const double turns : {-1.0, 0.0, 1.0}) {
        const double passed = kFullAngle * turns;
        if ((lambda < passed) == (next < passed))
          continue;
        const Point& near = std::abs(next - passed) < std::abs(lambda - passed) ? after : before;
        tryFrom(near.theta - passed * TubeVector::Unit(tube), kLongestFix);
      }
      const bool closed = (after.theta - theta).cwiseAbs().maxCoeff() < 1e-2 && std::abs(next) < 1e-2;
      return std::abs(next) < 1.05 * kFullAngle && !closed;
    };
    followArc<kMaxTubes>(start, 0.0, sense, ArcLimits{}, system, visit);
  }

 private:
  struct Point {
    TubeVector theta;
    void move(const TubeVector& change) { theta += change; }
  };

  const ConcentricTubeArm& arm_;
  const Equilibrium& equilibrium_;
  const JointsRef q_;
  const TubeJoints joints_;
  Segmentation parts_;
  std::vector<TubeVector> found_;
};

}  // namespace

std::vector<EquilibriumInfo> CompliantModel::equilibria(const JointsRef& q) const {
  std::vector<EquilibriumInfo> result;
  if (checkJoints(arm_, q) != ModelStatus::kOk)
    return result;
  const int n = arm_.tubeCount();
  Search search(arm_, equilibrium_, q);
  if (Equilibrium::Root cold; equilibrium_.find(q, Branch{}, cold) == ModelStatus::kOk)
    search.tryFrom(cold.theta, 0.1);
  search.scan(n == 2 ? 32 : n == 3 ? 12 : 8);
  for (std::size_t k = 0; k < search.found().size(); ++k) {
    for (int tube = 1; tube < n; ++tube) {
      for (const double sense : {1.0, -1.0})
        search.turn(TubeVector(search.found()[k]), tube, sense);
    }
  }
  Segmentation parts;
  segment(arm_, q, parts);
  for (const TubeVector& theta : search.found()) {
    EquilibriumInfo& info = result.emplace_back();
    const EndAngleSweep<double> sweep(arm_, parts, TubeJoints(q).beta, theta, 1.0, StepDepth::kAngles);
    Equilibrium::Root root;
    root.theta = theta;
    root.linearise(sweep);
    root.remember(q, info.branch);
    for (int i = 0; i < n; ++i)
      info.winding[i] = info.branch.winding(i);
    info.energy = energyOf(arm_, parts, q, theta);
    info.stability = sweep.determinant().minimum();
    info.conjugate_points = sweep.determinant().conjugatePoints();
  }
  std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.energy < b.energy; });
  return result;
}

}  // namespace tandem::kinematics
