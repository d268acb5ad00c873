// SPDX-License-Identifier: Apache-2.0
/** @file Publication of distances between the arms' bodies and to the port. */
#pragma once

#include "kinematics/clearance.h"
#include "robots/robot_model.h"
#include "services/runtime/outbox.h"
#include "services/runtime/process.h"

namespace tandem::control_service {

/** Clearances of all pairs of whole bodies at measured joints. Stateful as elastic arms are: their equilibria are
 * followed from state to state. */
class ClearanceMeter {
 public:
  ClearanceMeter(const runtime::Setup& setup, const robots::RobotModel& robot);
  /// Bodies of arms that are not measured, or for which the model cannot answer, are left out. Allocates.
  dds::Clearances measure(const dds::ActuationState& state);

 private:
  bool makeBody(const dds::ActuationState& state, int k);

  const runtime::Setup& setup_;
  const robots::RobotModel& robot_;
  std::vector<kinematics::Branch> branches_;
  std::vector<kinematics::Body> bodies_;
  std::uint64_t session_ = 0, sequence_ = 0;
  std::uint32_t joint_resets_ = 0;
};

/** Publishes control/clearance from a thread of its own, which looks at the newest state when it has time: bodies of
 * elastic arms take long. */
class ClearancePublisher {
 public:
  ClearancePublisher(dds::Bus& bus, const runtime::Setup& setup, const robots::RobotModel& robot);
  /// Before enterRealtime(): the thread inherits the scheduling of the caller.
  void start() { outbox_.start(); }
  void stop() { outbox_.stop(); }
  /// Wait-free; from one thread. Of catheters nothing is said.
  void post(const dds::ActuationState& state) noexcept {
    if (measures_)
      states_.post(state);
  }

 private:
  bool measures_;
  ClearanceMeter meter_;
  dds::Writer<dds::Clearances> writer_;
  runtime::Outbox outbox_;
  runtime::Outbox::Latest<dds::ActuationState>& states_;
};

}  // namespace tandem::control_service
