// SPDX-License-Identifier: Apache-2.0
/** @file Requests of clients as plain structs that the periodic thread can take. */
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "control/parameters.h"
#include "experiments/run_record.h"
#include "planning/reference_tracker.h"
#include "safety/operating_state.h"
#include "services/dds/messages.h"
#include "services/setup/process.h"

namespace tandem::service {

/** A request, parsed and checked as far as that goes without knowing the robot's state. */
struct ControlOrder {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  dds::ControlKind kind = dds::ControlKind::kKeepLease;
  int arm = dds::kAllArms;
  bool from_topic = false;  ///< from arm_x/state_command, which knows no clients
  safety::StateCommand command = safety::StateCommand::kDisable;
  int joint_count = 0;
  std::array<double, safety::kMaxJointsPerArm> joints{};
  planning::ReferenceTracker* tracker = nullptr;  ///< a method change: the tracker to use from now on
};

/** The answer to an order, for the thread that publishes. */
struct OrderReply {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  dds::ReplyCode code = dds::ReplyCode::kOk;
  std::array<char, 160> reason{};
  planning::ReferenceTracker* retired = nullptr;  ///< no longer used by the periodic thread: delete it
  bool method_accepted = false;
  std::uint64_t status = 0;  ///< sequence of the last control/status from before the order
};

/** Turns requests into orders; owns the settings of the method. Used by DDS threads and by the publisher thread, never
 * by the periodic one. */
class OrderDesk {
 public:
  OrderDesk(const Setup& setup, const experiments::RobotModel& robot);

  /// @return an order, or nothing and a reply that says why.
  std::optional<ControlOrder> parse(const dds::ControlRequest& request, dds::Reply& refusal);
  std::optional<ControlOrder> parse(const std::string& arm,
                                    const dds::StringStamped& command,
                                    std::string& refusal) const;

  /// What follows from the answer: settings become those of the accepted method, retired trackers are deleted.
  dds::Reply settle(const OrderReply& reply);

  /// A tracker for the present settings.
  std::unique_ptr<planning::ReferenceTracker> makeTracker() const;

 private:
  struct Settings {
    control::Method method;
    control::MethodParameters parameters;
    planning::Gains gains;
  };
  std::unique_ptr<planning::ReferenceTracker> makeTracker(const Settings& settings) const;
  Settings changed(const dds::ControlRequest& request) const;

  const experiments::RobotModel& robot_;
  std::vector<std::string> arm_names_;
  safety::RobotVector home_;               ///< of catheters: their posture
  std::vector<control::JointKind> kinds_;  ///< of catheters; empty for tubes
  mutable std::mutex mutex_;
  Settings settings_;
  Settings proposed_;
};

}  // namespace tandem::service
