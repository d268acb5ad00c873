// SPDX-License-Identifier: Apache-2.0
#include "planning/start_choice.h"

#include <algorithm>
#include <cmath>

#include "planning/detail/index.h"

namespace tandem::planning {
namespace {

constexpr double kTie = 1e-6;   // resolution of the room: a smaller difference is a tie
constexpr double kSame = 1e-3;  // in z: below it two starts are equal

bool known(const Arms& arms, const std::vector<StartCandidate>& candidates, const safety::RobotVector& q) {
  return std::any_of(candidates.begin(), candidates.end(), [&](const StartCandidate& other) {
    for (int j = 0; j < q.size(); ++j) {
      double difference = q[j] - other.q[j];
      if (PoseProblem::unit(arms, j) == 1.0)
        difference = std::remainder(difference, 2.0 * M_PI);
      if (std::abs(difference) > kSame * PoseProblem::unit(arms, j))
        return false;
    }
    return true;
  });
}

/// @return false if the check was cancelled or the start is not valid.
bool judge(const Arms& arms, const TrajectorySpec& spec, const FeasibilityOptions& options, StartCandidate& candidate) {
  const FeasibilityReport report = checkTrajectory(arms, spec, candidate.q, options);
  if (report.cancelled || !report.start.empty())
    return false;
  candidate.unreachable = report.unreachable();
  candidate.room = roomAt(arms, candidate.q, safety::kUnlimited, options.ik.demands);
  candidate.mean_room = candidate.room;
  for (const PointReport& point : report.points) {
    const double room = roomAt(arms, point.q, point.stability, options.ik.demands);
    candidate.room = std::min(candidate.room, room);
    candidate.mean_room += room;
  }
  candidate.mean_room /= static_cast<double>(report.points.size() + 1);
  return true;
}

}  // namespace

double roomAt(const Arms& arms, const safety::RobotVector& q, double stability, const Demands& demands) {
  double room = stability - demands.stability.value_or(0.0);
  for (int arm = 0; arm < arms.count(); ++arm) {
    const Eigen::VectorXd own = q.segment(arms.offset(arm), arms.size(arm));
    const safety::ArmLimits& limits = *arms.limits[at(arm)];
    for (int j = 0; j < arms.size(arm); ++j) {
      const double unit = PoseProblem::unit(arms, arms.offset(arm) + j);
      room =
          std::min({room, (limits.joints[at(j)].upper - own[j]) / unit, (own[j] - limits.joints[at(j)].lower) / unit});
    }
    for (const safety::LinearRow& row : limits.rows)
      room = std::min(room, (row.b - safety::rowValue(row, own)) / 0.1);
  }
  return room;
}

StartChoice chooseStart(const Arms& arms,
                        const TrajectorySpec& spec,
                        const safety::RobotVector& given,
                        const StartOptions& options) {
  StartChoice choice;
  TrajectorySpec judged = spec;
  judged.point_count = std::min(spec.point_count, options.most_points);
  StartCandidate first{given, 0, 0.0, 0.0};
  const auto cancelled = [&] { return options.feasibility.ik.cancelled && options.feasibility.ik.cancelled(); };
  if (judge(arms, judged, options.feasibility, first))
    choice.candidates.push_back(first);
  std::vector<TipTarget> targets;
  for (int arm = 0; arm < arms.count(); ++arm) {
    kinematics::Tip tip;
    if (arms.models[at(arm)]->tip(given.segment(arms.offset(arm), arms.size(arm)), tip) != kinematics::ModelStatus::kOk)
      return choice;
    targets.push_back({arm, tip.pose.translation(), {}});
  }
  IkOptions ik = options.feasibility.ik;
  ik.starts = std::min(ik.starts, 4);
  ik.demands.stability = ik.demands.stability ? std::optional(*ik.demands.stability + 0.05) : std::nullopt;
  const InverseKinematics inverse(arms, ik);
  std::vector<JointSampler> samplers;
  for (const safety::ArmLimits* limits : arms.limits)
    samplers.emplace_back(*limits);
  std::mt19937_64 engine(ik.seed);
  for (int i = 0; i < options.tries && !cancelled(); ++i) {
    safety::RobotVector reference(arms.jointCount());
    for (int arm = 0; arm < arms.count(); ++arm)
      reference.segment(arms.offset(arm), arms.size(arm)) = samplers[at(arm)].random(engine);
    const IkAnswer answer = inverse.solve(targets, reference);
    StartCandidate candidate{answer.q, 0, 0.0, 0.0};
    if (answer.reach == Reach::kReached && !known(arms, choice.candidates, candidate.q) &&
        judge(arms, judged, options.feasibility, candidate))
      choice.candidates.push_back(candidate);
    if (options.progress)
      options.progress(i + 1, options.tries);
  }
  choice.cancelled = cancelled();
  std::stable_sort(choice.candidates.begin(), choice.candidates.end(), [](const auto& a, const auto& b) {
    if (a.unreachable != b.unreachable)
      return a.unreachable < b.unreachable;
    const double left = std::round(a.room / kTie), right = std::round(b.room / kTie);
    return left != right ? left > right : a.mean_room > b.mean_room;
  });
  return choice;
}

}  // namespace tandem::planning
