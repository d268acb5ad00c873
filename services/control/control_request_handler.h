// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of control requests to internal structs, and of results to replies. */
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "operation/control_setup.h"
#include "operation/requests.h"
#include "planning/method_settings.h"
#include "planning/reference_tracker.h"
#include "services/dds/messages.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"

namespace tandem::control_service {

/// Configuration of the control core; both arguments outlive it.
inline operation::ControlSetup controlSetupOf(const runtime::Setup& setup, const robots::RobotModel& robot) {
  return {setup.deployment, setup.robot, robot, setup.session, runtime::monotonicNow};
}

/** Converts requests; owns the settings of the method. For DDS threads and the publisher thread, never for the periodic
 * one. */
class ControlRequestHandler {
 public:
  ControlRequestHandler(const runtime::Setup& setup, const robots::RobotModel& robot);

  /// @param owner  lease owner, 0: none @return the converted request, or nothing and a refusal with the reason.
  std::optional<operation::ParsedControlRequest> parse(const dds::ControlRequest& request,
                                                       std::uint64_t owner,
                                                       dds::Reply& refusal);
  std::optional<operation::ParsedControlRequest> parse(const std::string& arm,
                                                       const dds::StringStamped& command,
                                                       std::string& refusal) const;

  /// Converts a reply; also stores the settings of an accepted method and deletes retired trackers.
  dds::Reply replyTo(const operation::ControlReply& reply);

  /// Present values of the parameters, for diagnostics.
  runtime::Details parameters() const;

  /// Creates a tracker with the present settings.
  std::unique_ptr<planning::ReferenceTracker> makeTracker() const;

 private:
  std::unique_ptr<planning::ReferenceTracker> makeTracker(const planning::MethodSettings& settings) const;
  planning::MethodSettings changed(const dds::ControlRequest& request) const;

  const config::Robot& file_;
  const robots::RobotModel& robot_;
  std::vector<std::string> arm_names_;
  mutable std::mutex mutex_;
  planning::MethodSettings settings_;
  planning::MethodSettings proposed_;
};

}  // namespace tandem::control_service
