// SPDX-License-Identifier: Apache-2.0
#include "operation/followed_reference.h"

#include <algorithm>

#include "operation/convert.h"

namespace tandem::operation {

FollowedReference::FollowedReference(const ControlSetup& setup)
    : setup_(setup), budget_(std::max(setup.deployment.budgets.planning_reference, 2.5 * setup.period())) {}

safety::FaultRecord FollowedReference::judge(const safety::StateStamps& statuses, std::int64_t now) noexcept {
  const double age = statuses.age(message_.answers_control, now);
  if (age <= budget_)
    return {};
  message_.phase = static_cast<std::uint8_t>(planning::Phase::kIdle);
  return {bit(safety::Fault::kReferenceTimeout), safety::FaultCause::kUnspecified, idl::kNoJoint, age, budget_};
}

planning::Reference FollowedReference::tasks(const msg::ActuationState& state) const noexcept {
  constexpr double kRounding = 1e-6;  // m or rad
  planning::Reference tasks = msg::tasksOf(message_);
  tasks.posture = msg::postureOf(message_, setup_.arms(), state.joint_count);
  for (int k = 0; k < setup_.arms() && tasks.posture.size() > 0; ++k) {
    if (!(safety::largestViolation(setup_.limits(k), setup_.of(k, tasks.posture)) <= kRounding))
      tasks.posture.resize(0);
  }
  return tasks;
}

}  // namespace tandem::operation
