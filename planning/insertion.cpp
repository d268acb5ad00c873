// SPDX-License-Identifier: Apache-2.0
#include "planning/insertion.h"

#include <algorithm>
#include <stdexcept>

#include "planning/detail/index.h"
#include "planning/tips.h"

namespace tandem::planning {
namespace {

int translations(const safety::ArmLimits& limits, int joints) {
  int count = 0;
  while (count < joints && limits.isTranslation(count))
    ++count;
  return count;
}

}  // namespace

void setInsertion(const Arms& arms, const safety::RobotVector& start, TrajectorySpec& spec) {
  auto* insertion = std::get_if<Insertion>(&spec.shape);
  if (insertion == nullptr)
    return;
  const auto fail = [](const std::string& what) { throw std::invalid_argument("shape: insertion: " + what); };
  if (start.size() != arms.jointCount())
    fail("found " + std::to_string(start.size()) + " joints at the start, expected " +
         std::to_string(arms.jointCount()));
  const int tubes = translations(*arms.limits[at(spec.arm)], arms.size(spec.arm)), first = arms.offset(spec.arm);
  double length = 0.0;
  for (const InsertionStage& stage : insertion->stages) {
    if (stage.tubes > tubes)
      fail("found tubes: " + std::to_string(stage.tubes) + ", expected 1 to " + std::to_string(tubes) + " of " +
           arms.label(spec.arm));
    length += stage.length;
  }
  insertion->joints.clear();
  insertion->tips.clear();
  TipFollower tips(arms.models);
  tips.update(start);  // from here on along the path
  const auto helix_angle = [&](const safety::RobotVector& q, int tube) {
    return arms.models[at(spec.arm)]->helixAngle(q.segment(first, arms.size(spec.arm)), tube);
  };
  for (int k = 1; k <= spec.point_count; ++k) {
    double left = length * k / spec.point_count;
    safety::RobotVector q = start;
    for (const InsertionStage& stage : insertion->stages) {
      const double part = std::min(left, stage.length);
      q.segment(first, stage.tubes).array() += part;
      left -= part;
    }
    for (int i = 0; i < tubes; ++i) {
      if (const double turn = helix_angle(start, i) - helix_angle(q, i); turn != 0.0)
        q[first + tubes + i] += turn;
    }
    if (!tips.update(q))
      fail("at point " + std::to_string(k) + ": " + std::string(kinematics::describe(tips.status())));
    insertion->joints.push_back(q);
    insertion->tips.push_back(tips.tip(spec.arm).pose.translation());
  }
}

}  // namespace tandem::planning
