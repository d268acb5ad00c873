// SPDX-License-Identifier: Apache-2.0
/** @file Bus, topics and request handlers of tandem-control, used in real time and in lock-step. */
#pragma once

#include <spdlog/spdlog.h>

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "config/arm_names.h"
#include "operation/control_core.h"
#include "robots/capability.h"
#include "robots/orientation_freedom.h"
#include "services/control/clearance_publisher.h"
#include "services/control/control_request_handler.h"
#include "services/control/crtk_command_handler.h"
#include "services/control/crtk_publisher.h"
#include "services/control/object_loop.h"
#include "services/control/operator_publisher.h"
#include "services/control/request_log.h"
#include "services/dds/reply.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/identity.h"

namespace tandem::control_service {

/** An arm with power that no client commands, for the logging thread. */
struct IdleReport {
  int arm = 0;
  double idle = 0.0;  ///< s
  safety::IdlePower::Decision decision{};
};

/** Common parts of real time and lock-step: bus, topics, request handlers. */
struct Service {
  explicit Service(const runtime::Setup& s)
      : setup(s),
        robot(s.robot, s.deployment.model),
        handler(s, robot),
        object_loop(has(s.robot, robots::Capability::kCommonPath) ? std::make_unique<ObjectLoop>(s) : nullptr),
        core(controlSetupOf(s, robot), handler.makeTracker(), object_loop.get()),
        crtk_command_handler(s, robot),
        request_log(config::armList(s.robot)),
        bus(runtime::busOptions(s.deployment, s.name)),
        crtk(bus, s, robot),
        operators(bus, s, crtk_command_handler),
        clearance(bus, s, robot) {
    robots::requireOrientation(s.deployment, s.robot);
    commands = bus.writer(dds::kActuationCommand);
    limits = bus.writer(dds::kActuationLimits);
    statuses = bus.writer(dds::kControlStatus);
    replies = bus.writer(dds::kControlReply);
    permissions = bus.writer(dds::kControlPermissions);
  }

  /// Creates all readers; every callback runs on a DDS thread.
  template <class OnState,
            class OnTips,
            class OnReference,
            class OnRequest,
            class OnStop,
            class OnInput,
            class OnCrtk,
            class OnMismatch>
  void listen(OnState on_state,
              OnTips on_tips,
              OnReference on_reference,
              OnRequest on_request,
              OnStop on_stop,
              OnInput on_input,
              OnCrtk on_crtk,
              OnMismatch on_mismatch) {
    mismatches.emplace(
        bus, [this](const dds::Reply& reply) { replies.write(reply); }, on_mismatch);
    readers.push_back(bus.reader(dds::kControlStatus, [](const dds::ControlStatus&) {}));  // to detect mismatches
    readers.push_back(bus.reader(dds::kTeleopInput, on_input));
    const config::Crtk& admission = setup.deployment.teleoperation.crtk;
    dds::ReaderOptions admitted;
    if (!admission.admitsAll())
      admitted.senders = admission.clients;
    if (!admission.admitsNone())
      crtk_command_handler.listen(bus, on_crtk, admitted, readers);
    if (setup.deployment.feedback == planning::Feedback::kSensor)
      readers.push_back(bus.reader(dds::kSensingTips, on_tips));
    readers.push_back(bus.reader(dds::kActuationState, on_state));
    readers.push_back(bus.reader(dds::kPlanningReference, on_reference));
    readers.push_back(bus.reader(dds::kControlRequest, [this, on_request](const dds::ControlRequest& request) {
      if (const std::string line = request_log.line(request, bus.identityOf(request.client), runtime::monotonicNow());
          !line.empty())
        spdlog::info("{}", line);
      dds::Reply refusal;
      if (const auto parsed = handler.parse(request, owner.load(std::memory_order_relaxed), refusal)) {
        on_request(*parsed);
      } else {
        spdlog::warn("{}", runtime::refusalLine(refusal.reason, refusal.client, bus.identityOf(refusal.client)));
        replies.write(refusal);
      }
    }));
    readers.push_back(bus.reader(dds::kStop, [on_stop](const dds::Stop& stop) {
      spdlog::error("stop: {}", stop.reason);
      on_stop();
    }));
    std::vector<std::string> groups = config::armList(setup.robot);
    if (groups.size() >= 2)
      groups.push_back(dds::kPair);
    if (admission.admitsNone())
      groups.clear();
    for (const std::string& group : groups) {
      const auto take = [this, group, on_request](const dds::StringStamped& command) {
        std::string refusal;
        auto parsed = handler.parse(group, command, refusal);
        if (!parsed)
          return spdlog::warn("{}", refusal);
        parsed->control_session = setup.session;
        parsed->answers_control = crtk_command_handler.answered(command.stamp);
        if (parsed->arm != dds::kAllArms || robot.armCount() == 2)
          return on_request(*parsed);
        for (parsed->arm = 0; parsed->arm < 2; ++parsed->arm)  // the pair of a robot with more than two arms
          on_request(*parsed);
      };
      readers.push_back(bus.reader(dds::kStateCommand, group, take, admitted));
    }
    clock.emplace(bus, setup);
  }

  /// Calls `report` for every arm whose idle time-out has passed.
  template <class Report>
  static void reportIdle(const operation::CycleOutput& output, Report report) noexcept {
    for (std::size_t k = 0; k < output.idle.size(); ++k) {
      if (output.idle[k] != safety::IdlePower::Decision::kNothing)
        report(IdleReport{static_cast<int>(k), output.status.idle[k], output.idle[k]});
    }
  }

  /// Not for the periodic thread.
  void logIdle(const IdleReport& report) const {
    const std::string& arm = setup.robot.arms[static_cast<std::size_t>(report.arm)].name;
    if (report.decision == safety::IdlePower::Decision::kPowerOff) {
      spdlog::warn("{}: power removed after {:.0f} s without a commander", arm, report.idle);
    } else {
      spdlog::warn(
          "{}: has had power for {:.0f} s without a commander, and keeps it: its axes are not declared to hold their "
          "position without power (holds_without_power in the hardware file); disable it",
          arm, report.idle);
    }
  }

  /// Fills the snapshot for the publisher thread. @param m  owned by the periodic thread
  void fillSnapshot(std::int64_t now,
                    const dds::ActuationState& state,
                    const operation::CycleOutput& output,
                    Snapshot& m) const noexcept {
    m.state = state;
    m.status = output.status;
    m.permissions = output.permissions;
    m.commanded = output.command.velocity;
    for (int k = 0; k < robot.armCount(); ++k)
      m.faults[static_cast<std::size_t>(k)] = core.faultRecord(k);
    core.fillSnapshots(now, m.operators, m.crtk);
  }

  void publish(const Snapshot& m) {
    crtk.publish(m, crtk_command_handler.stampFeedback(m.state, m.status), handler.parameters());
    permissions.write(m.permissions);
    operators.publish(m.status, m.operators, m.crtk);
  }

  void answer(const operation::ControlReply& reply) {
    dds::Reply message = handler.replyTo(reply);
    message.reason += more(reply);
    if (message.accepted == 0 && message.request != 0)
      spdlog::warn("{}", runtime::refusalLine(message.reason, message.client, bus.identityOf(message.client)));
    if (message.request != 0)
      replies.write(message);
  }

  /// Supplement to the reason of a refusal: the clients or processes that it concerns, from their identities.
  std::string more(const operation::ControlReply& reply) const {
    std::string text;
    const operation::Reason reason = reply.refusal.reason;
    if (reason == operation::Reason::kMismatch) {
      for (const std::string& mismatch : runtime::mismatches(bus))
        text += "; " + mismatch;
    }
    const bool others = reason == operation::Reason::kOtherLease || reason == operation::Reason::kLeaseTaken;
    if (const auto who = bus.identityOf(reply.owner); others && who)
      text = ": " + runtime::describe(*who);
    if (others)
      text += "; only that client can resume the motion that it started";
    return text;
  }

  const runtime::Setup& setup;
  robots::RobotModel robot;
  ControlRequestHandler handler;
  std::unique_ptr<ObjectLoop> object_loop;  ///< with robots::Capability::kCommonPath
  operation::ControlCore core;
  CrtkCommandHandler crtk_command_handler;
  RequestLog request_log;  // of the thread of the requests
  dds::Bus bus;
  CrtkPublisher crtk;
  OperatorPublisher operators;
  ClearancePublisher clearance;
  dds::Writer<dds::ActuationCommand> commands;
  dds::Writer<dds::ActuationLimits> limits;
  dds::Writer<dds::ControlStatus> statuses;
  dds::Writer<dds::Reply> replies;
  dds::Writer<dds::ControlPermissions> permissions;
  std::optional<runtime::MismatchHandler> mismatches;
  std::vector<dds::Reader> readers;
  std::optional<runtime::ClockRequestHandler> clock;
  std::atomic<std::uint64_t> owner{0};  ///< lease owner, last value from control's thread
};

}  // namespace tandem::control_service
