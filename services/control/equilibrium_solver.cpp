// SPDX-License-Identifier: Apache-2.0
#include "services/control/equilibrium_solver.h"

#include <spdlog/spdlog.h>

namespace tandem::control_service {

EquilibriumSolver::EquilibriumSolver(const runtime::Setup& setup)
    : setup_(setup),
      follower_(robots::makeEquilibriumFollower(setup.robot)),
      requests_(outbox_.latest<Request>([this](const Request& request) { solveEquilibrium(request); })) {}

void EquilibriumSolver::start() {
  started_ = true;
  outbox_.start();
}

void EquilibriumSolver::submit(const Request& request) noexcept {
  if (started_)
    requests_.post(request);
  else
    solveEquilibrium(request);
}

void EquilibriumSolver::solveEquilibrium(const Request& request) {
  if (request.joint_resets != joint_resets_)
    follower_.emplace(robots::makeEquilibriumFollower(setup_.robot));
  joint_resets_ = request.joint_resets;
  const safety::RobotVector q = Eigen::VectorXd::Map(request.joints.data(), request.joint_count);
  const bool moved = !result_.equilibrium.known() || q != result_.equilibrium.q();
  const std::string why = follower_->solveEquilibrium(q);
  if (!why.empty() && why != last_reason_)
    spdlog::warn("no equilibrium of the common object at the present joints: {}", why);
  last_reason_ = why;
  if (!why.empty())
    return;
  if (moved)
    robots::writeEquilibrium(follower_->mechanism(), q, result_.equilibrium);
  result_.stamp = request.stamp;
  result_.joint_resets = request.joint_resets;
  results_.store(result_);
}

}  // namespace tandem::control_service
