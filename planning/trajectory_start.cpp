// SPDX-License-Identifier: Apache-2.0
#include "planning/detail/trajectory_start.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "planning/detail/index.h"

namespace tandem::planning {

Start lookAt(const Arms& arms, const safety::RobotVector& q, const Demands& demands) {
  constexpr double kViolation = 1e-6;
  Start start;
  if (q.size() != arms.jointCount() || !q.allFinite()) {
    start.wrong = "start: found " + std::to_string(q.size()) + " joints" + (q.allFinite() ? "" : ", not all finite") +
                  ", expected " + std::to_string(arms.jointCount()) + " finite joints";
    return start;
  }
  start.tips.resize(at(arms.count()));
  start.branches.resize(at(arms.count()));
  for (int arm = 0; arm < arms.count(); ++arm) {
    const Eigen::VectorXd own = q.segment(arms.offset(arm), arms.size(arm));
    const auto status = arms.models[at(arm)]->tip(own, start.branches[at(arm)], start.tips[at(arm)]);
    if (status != kinematics::ModelStatus::kOk) {
      start.wrong = arms.label(arm) + ": " + std::string(kinematics::describe(status));
      return start;
    }
    if (safety::largestViolation(*arms.limits[at(arm)], own) > kViolation)
      start.wrong = arms.label(arm) + " starts outside its limits";
    const kinematics::Tip& tip = start.tips[at(arm)];
    if (tip.conjugate_points > 0 || (demands.stability && tip.stability < *demands.stability))
      start.wrong = arms.label(arm) + " starts unstable or below the required stability";
  }
  return start;
}

std::string unmetAtStart(const Arms& arms,
                         const std::vector<TipTarget>& targets,
                         const safety::RobotVector& q,
                         const std::vector<kinematics::Branch>& branches,
                         const InverseKinematics& judge,
                         const InverseKinematics& near,
                         const Demands& demands) {
  if (judge.judge(targets, q, branches).reach == Reach::kReached)
    return {};
  const Reach reach = near.solve(targets, q, branches, true).reach;
  if (reach == Reach::kReached || reach == Reach::kCancelled)
    return {};
  const PosePoint point = evaluate({&arms, targets, q, branches, false, false, demands}, q);
  double distance = safety::kUnlimited;
  for (Eigen::Index k = 0; k < point.constraints.size(); ++k) {
    if (point.names[at(static_cast<int>(k))].kind == ConstraintName::Kind::kClearance)
      distance = std::min(distance, demands.clearance.value_or(0.0) + kLengthUnit * point.constraints[k]);
  }
  if (!(distance < demands.clearance.value_or(0.0)))
    return "at the start an arm is less stable or closer to the port than required; joints near it with the same "
           "tips do not change that";
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "at the start the distance of the arms is %.3g mm, expected at least %.3g mm; "
                "joints near it with the same tips do not change that",
                1e3 * distance, 1e3 * *demands.clearance);
  return text.data();
}

}  // namespace tandem::planning
