// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tasks/shaft_search.h"

#include <algorithm>
#include <cmath>

#include "kinematics/rotations.h"
#include "kinematics/tasks/task_kind.h"

namespace tandem::kinematics {
namespace {

/// Distance along the shaft from a point of it to the foot, to first order, m.
double wayToFoot(const BackbonePoint& from, const Eigen::Vector3d& target) {
  return from.tangent.dot(target - from.position);
}

}  // namespace

ModelStatus ShaftSearch::lookAt(const ArmModel& model,
                                const JointsRef& q,
                                const Branch& branch,
                                double s,
                                bool derivatives) {
  s_one_[0] = s;
  Branch aside = branch;
  return model.backbone(q, aside, s_one_, derivatives, one_);
}

ModelStatus ShaftSearch::find(const ArmModel& model,
                              const JointsRef& q,
                              const Branch& branch,
                              const Eigen::Vector3d& target,
                              bool derivatives,
                              ShaftPoint& foot) {
  constexpr int kMostSteps = 60;
  constexpr double kOnFoot = 1e-10;  // m
  if (q.size() != model.jointCount())
    return ModelStatus::kWrongSize;
  BodySections sections;
  const int count = model.sections(q, sections);
  const double length = sections[static_cast<std::size_t>(count - 1)].end;
  for (std::size_t k = 0; k < s_.size(); ++k)
    s_[k] = length * static_cast<double>(k) / kNodes;
  Branch aside = branch;
  if (const ModelStatus status = model.backbone(q, aside, s_, false, nodes_); status != ModelStatus::kOk)
    return status;
  const auto nearest = std::min_element(nodes_.begin(), nodes_.end(), [&](const auto& a, const auto& b) {
    return (a.position - target).squaredNorm() < (b.position - target).squaredNorm();
  });
  const auto k = static_cast<std::size_t>(nearest - nodes_.begin());
  const double way = wayToFoot(*nearest, target);
  foot.s = s_[k] + way;
  const bool behind = k == 0 && way <= 0.0, beyond = k == kNodes && way >= 0.0;
  if (!behind && !beyond) {
    // Regula falsi with the Illinois rule, from the piece of the shaft in which the foot is.
    const std::size_t first = way > 0.0 ? k : k - 1;
    double low = s_[first], high = s_[first + 1];
    double at_low = wayToFoot(nodes_[first], target), at_high = wayToFoot(nodes_[first + 1], target);
    int side = 0;
    foot.s = way > 0.0 ? low : high;
    for (int i = 0; i < kMostSteps && at_low > 0.0 && at_high < 0.0; ++i) {
      foot.s = (low * at_high - high * at_low) / (at_high - at_low);
      if (const ModelStatus status = lookAt(model, q, branch, foot.s, false); status != ModelStatus::kOk)
        return status;
      const double now = wayToFoot(one_[0], target);
      if (std::abs(now) < kOnFoot)
        break;
      if (now > 0.0) {
        low = foot.s, at_low = now;
        at_high *= side > 0 ? 0.5 : 1.0;
        side = 1;
      } else {
        high = foot.s, at_high = now;
        at_low *= side < 0 ? 0.5 : 1.0;
        side = -1;
      }
    }
  }
  const bool moves = derivatives && foot.s > 0.0;
  if (const ModelStatus status = lookAt(model, q, branch, std::max(0.0, foot.s), moves); status != ModelStatus::kOk)
    return status;
  const BackbonePoint& at = one_[0];
  foot.pose.linear() = rotationBy(smallestRotation(Eigen::Vector3d::UnitZ(), at.tangent)).toRotationMatrix();
  foot.pose.translation() = at.position + std::min(0.0, foot.s) * at.tangent;
  foot.jacobian.setZero(6, model.jointCount());
  if (moves)
    foot.jacobian.topRows<3>() = at.jacobian;
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics
