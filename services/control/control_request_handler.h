// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of control requests to internal structs, and of results to replies. */
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "operation/control_setup.h"
#include "operation/requests.h"
#include "planning/reference_tracker.h"
#include "services/dds/messages.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"

namespace tandem::control_service {

/// What control operates. Both outlive it.
inline operation::ControlSetup controlSetupOf(const runtime::Setup& setup, const robots::RobotModel& robot) {
  return {setup.deployment, setup.robot, robot, setup.session, runtime::monotonicNow};
}

/** Turns requests into orders; owns the settings of the method. Used by DDS threads and by the publisher thread, never
 * by the periodic one. */
class ControlRequestHandler {
 public:
  ControlRequestHandler(const runtime::Setup& setup, const robots::RobotModel& robot);

  /// @param holder  of the lease, 0: nobody  @return an order, or nothing and a reply that says why.
  std::optional<operation::ParsedControlRequest> parse(const dds::ControlRequest& request,
                                                       std::uint64_t holder,
                                                       dds::Reply& refusal);
  std::optional<operation::ParsedControlRequest> parse(const std::string& arm,
                                                       const dds::StringStamped& command,
                                                       std::string& refusal) const;

  /// What follows from the answer: settings become those of the accepted method, retired trackers are deleted.
  dds::Reply replyTo(const operation::ControlReply& reply);

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

  const config::Robot& file_;
  const robots::RobotModel& robot_;
  std::vector<std::string> arm_names_;
  mutable std::mutex mutex_;
  Settings settings_;
  Settings proposed_;
};

}  // namespace tandem::control_service
