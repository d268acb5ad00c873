// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kinematics/rigid_model.h"
#include "kinematics/tasks/task_kind.h"
#include "planning/detail/index.h"
#include "planning/inverse_kinematics.h"

namespace tandem::planning {
namespace {

/// Shifts rotations without limits by whole turns toward the reference.
void unwind(const Arms& arms, const safety::RobotVector& reference, safety::RobotVector& q) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (int arm = 0; arm < arms.count(); ++arm) {
    const auto& joints = arms.limits[at(arm)]->joints;
    for (int j = arms.size(arm) / 2; j < arms.size(arm); ++j) {
      const int k = arms.offset(arm) + j;
      const double turns = kTurn * std::round((reference[k] - q[k]) / kTurn);
      if (q[k] + turns >= joints[at(j)].lower && q[k] + turns <= joints[at(j)].upper)
        q[k] += turns;
    }
  }
}

}  // namespace

safety::RobotVector InverseKinematics::neighbour(const safety::RobotVector& q,
                                                 double turn,
                                                 std::mt19937_64& engine) const {
  constexpr double kInwards = 1e-5, kFurtherInwards = 1e-2;
  const double share = turn > 0.0 ? kFurtherInwards : kInwards;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  safety::RobotVector result(q.size());
  for (int arm = 0; arm < arms_.count(); ++arm) {
    const int first = arms_.offset(arm), size = arms_.size(arm);
    const safety::ArmVector inside = samplers_[at(arm)].inside(q.segment(first, size));
    safety::ArmVector moved = inside + share * (samplers_[at(arm)].middle(inside) - inside);
    for (int j = size / 2; j < size; ++j)
      moved[j] += turn * unit(engine);
    result.segment(first, size) = samplers_[at(arm)].inside(moved);
  }
  return result;
}

std::vector<safety::RobotVector> InverseKinematics::starts(const PoseProblem& problem, std::uint64_t seed) const {
  std::vector<safety::RobotVector> result(at(options_.starts), problem.reference);
  std::mt19937_64 engine(seed);
  for (int arm = 0; arm < arms_.count(); ++arm) {
    const TipTarget* target = nullptr;
    for (const TipTarget& t : problem.targets)
      target = t.arm == arm ? &t : target;
    const kinematics::ArmModel& model = arms_.models[at(arm)]->approximation();
    const Eigen::Isometry3d& base = model.base();
    const JointSampler& sampler = samplers_[at(arm)];
    const bool turns = sampler.turnsFreely();
    const int n = arms_.size(arm) / 2, batch = std::max(1, options_.candidates / std::max(1, options_.starts));
    std::vector<std::pair<double, safety::ArmVector>> chosen;
    for (int k = 0; target != nullptr && k < options_.starts; ++k) {
      chosen.emplace_back(std::numeric_limits<double>::infinity(), sampler.random(engine));
      for (int i = 0; i < batch; ++i) {
        safety::ArmVector q = sampler.random(engine);
        kinematics::Tip tip;
        if (model.tip(q, tip) != kinematics::ModelStatus::kOk)
          continue;
        Eigen::Isometry3d pose = tip.pose;
        if (turns) {  // the whole arm rotated so that the tip has the azimuth of the target
          const Eigen::Vector3d is = base.inverse() * Eigen::Vector3d(pose.translation());
          const Eigen::Vector3d wanted = base.inverse() * target->position;
          const double angle = std::atan2(wanted.y(), wanted.x()) - std::atan2(is.y(), is.x());
          q.tail(n).array() += angle;
          pose = base * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * base.inverse() * pose;
        }
        double distance = (pose.translation() - target->position).norm();
        distance += kinematics::kLengthPerRadian * target->turned(pose);
        if (distance < chosen.back().first)
          chosen.back() = {distance, q};
      }
    }
    std::stable_sort(chosen.begin(), chosen.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t k = 0; k < chosen.size(); ++k)
      result[k].segment(arms_.offset(arm), 2 * n) = chosen[k].second;
  }
  for (safety::RobotVector& q : result)
    unwind(arms_, problem.reference, q);
  return result;
}

}  // namespace tandem::planning
