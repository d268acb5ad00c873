// SPDX-License-Identifier: Apache-2.0
/** @file Publication of distances between the arms' bodies and to the port. */
#pragma once

#include <atomic>
#include <limits>

#include "kinematics/clearance.h"
#include "robots/robot_model.h"
#include "safety/clearance_interlock.h"
#include "services/runtime/outbox.h"
#include "services/runtime/process.h"

namespace tandem::control_service {

/** Clearances of all pairs of bodies at measured joints. Stateful, because the branches of elastic arms are followed
 * from state to state. */
class ClearanceMeter {
 public:
  ClearanceMeter(const runtime::Setup& setup, const robots::RobotModel& robot);
  /// Omits arms without valid measurements or without a solution of their model. Allocates.
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

/** Publishes control/clearance from a separate thread, always for the newest state: bodies of elastic arms take long to
 * compute. */
class ClearancePublisher {
 public:
  ClearancePublisher(dds::Bus& bus, const runtime::Setup& setup, const robots::RobotModel& robot);
  /// Before enterRealtime(): the thread inherits the scheduling of the caller.
  void start() { outbox_.start(); }
  void stop() { outbox_.stop(); }
  /// Smallest distance of the last measurement. Wait-free; from any thread.
  safety::ClearanceSample nearest() const noexcept {
    return {distance_.load(std::memory_order_acquire), stamp_.load(std::memory_order_acquire)};
  }
  /// Wait-free; from one thread. No effect where the arms have no models of their own.
  void post(const dds::ActuationState& state) noexcept {
    if (measures_)
      states_.post(state);
  }

 private:
  void measure(const dds::ActuationState& state);
  void reportOverlap(const dds::ActuationState& state, double distance);

  const runtime::Setup& setup_;
  const robots::RobotModel& robot_;
  bool measures_;
  bool overlapped_ = false;
  std::atomic<double> distance_{std::numeric_limits<double>::infinity()};
  std::atomic<std::int64_t> stamp_{0};
  ClearanceMeter meter_;
  dds::Writer<dds::Clearances> writer_;
  runtime::Outbox outbox_;
  runtime::Outbox::Latest<dds::ActuationState>& states_;
};

}  // namespace tandem::control_service
