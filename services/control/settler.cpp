// SPDX-License-Identifier: Apache-2.0
#include "services/control/settler.h"

#include <spdlog/spdlog.h>

namespace tandem::service {

Settler::Settler(const Setup& setup)
    : setup_(setup),
      follower_(robots::makeRestFollower(setup.robot)),
      wishes_(outbox_.latest<Wish>([this](const Wish& wish) { settle(wish); })) {}

void Settler::start() {
  started_ = true;
  outbox_.start();
}

void Settler::ask(const Wish& wish) noexcept {
  if (started_)
    wishes_.post(wish);
  else
    settle(wish);
}

void Settler::settle(const Wish& wish) {
  if (wish.placement != placement_)
    follower_.emplace(robots::makeRestFollower(setup_.robot));
  placement_ = wish.placement;
  const safety::RobotVector q = Eigen::VectorXd::Map(wish.joints.data(), wish.joint_count);
  const bool moved = !answer_.rest.known() || q != answer_.rest.q();
  const std::string why = follower_->settle(q);
  if (!why.empty() && why != told_)
    spdlog::warn("no rest at the present joints: {}", why);
  told_ = why;
  if (!why.empty())
    return;
  if (moved)
    robots::fillRest(follower_->mechanism(), q, answer_.rest);
  answer_.stamp = wish.stamp;
  answer_.placement = wish.placement;
  answers_.store(answer_);
}

}  // namespace tandem::service
