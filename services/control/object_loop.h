// SPDX-License-Identifier: Apache-2.0
/** @file Closed loop on the pose of the common object. */
#pragma once

#include <memory>
#include <optional>

#include "operation/object_control.h"
#include "services/control/equilibrium_solver.h"
#include "services/dds/messages.h"

namespace tandem::control_service {

/** In lock-step each step computes the equilibrium at its joints and in the middle of its period. In real time another
 * thread (EquilibriumSolver) computes it at the predicted joints in the middle of the next period, and the step
 * extrapolates it to the actual joints to first order. */
class ObjectLoop : public operation::ObjectControl {
 public:
  /// @throw std::invalid_argument as robots::makeEquilibriumFollower() does.
  explicit ObjectLoop(const runtime::Setup& setup);

  /// Real time, before enterRealtime(). Without it every cycle computes its equilibrium itself: for tests.
  void start();
  void stop();

  void restart() noexcept override;
  dds::HoldReason step(std::int64_t now,
                       const safety::RobotVector& setpoint,
                       const safety::RobotVector& velocity,
                       const planning::Reference& tasks,
                       planning::ReferenceTracker& tracker,
                       planning::TrackResult& result) noexcept override;
  void requestEquilibrium(std::int64_t now,
                          const safety::RobotVector& setpoint,
                          const safety::RobotVector& velocity,
                          const planning::ReferenceTracker& tracker) noexcept override;

 private:
  void stepAtOnce(const safety::RobotVector& q,
                  const planning::Reference& tasks,
                  planning::ReferenceTracker& tracker,
                  planning::TrackResult& result);

  const runtime::Setup& setup_;
  double period_;
  double oldest_;                                          ///< longest permitted age of an equilibrium, s
  std::optional<robots::EquilibriumFollower> follower_;    ///< lock-step
  std::unique_ptr<EquilibriumSolver> equilibrium_solver_;  ///< real time
  std::uint32_t joint_resets_ = 0;
  planning::Equilibrium equilibrium_;
  EquilibriumSolver::Request request_;
  EquilibriumSolver::Result latest_;
};

}  // namespace tandem::control_service
