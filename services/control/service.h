// SPDX-License-Identifier: Apache-2.0
/** @file What tandem-control is made of, whichever way it runs. */
#pragma once

#include <spdlog/spdlog.h>

#include <optional>
#include <string>
#include <vector>

#include "services/control/clearance_publisher.h"
#include "services/control/control_core.h"
#include "services/control/crtk_desk.h"
#include "services/control/crtk_publisher.h"
#include "services/control/operator_publisher.h"
#include "services/setup/clock_desk.h"

namespace tandem::service {

/** What both ways of running share: the bus, the topics, the desk for requests. */
struct Service {
  explicit Service(const Setup& s)
      : setup(s),
        robot(s.robot, s.deployment.model),
        desk(s, robot),
        core(s, robot, desk.makeTracker()),
        crtk_desk(s, robot),
        bus(busOptions(s.deployment, s.name)),
        crtk(bus, s, robot),
        operators(bus, s, crtk_desk),
        clearance(bus, s, robot) {
    commands = bus.writer(dds::kActuationCommand);
    limits = bus.writer(dds::kActuationLimits);
    statuses = bus.writer(dds::kControlStatus);
    replies = bus.writer(dds::kControlReply);
  }

  /// Readers; every callback runs on a DDS thread.
  template <class OnState, class OnTips, class OnReference, class OnOrder, class OnStop, class OnInput, class OnCrtk>
  void listen(OnState on_state,
              OnTips on_tips,
              OnReference on_reference,
              OnOrder on_order,
              OnStop on_stop,
              OnInput on_input,
              OnCrtk on_crtk) {
    readers.push_back(bus.reader(dds::kTeleopInput, on_input));
    if (setup.deployment.teleoperation.crtk.commands)
      crtk_desk.listen(bus, on_crtk, readers);
    if (setup.deployment.feedback == planning::Feedback::kSensor)
      readers.push_back(bus.reader(dds::kSensingTips, on_tips));
    readers.push_back(bus.reader(dds::kActuationState, on_state));
    readers.push_back(bus.reader(dds::kPlanningReference, on_reference));
    readers.push_back(bus.reader(dds::kControlRequest, [this, on_order](const dds::ControlRequest& request) {
      dds::Reply refusal;
      if (const auto order = desk.parse(request, refusal)) {
        on_order(*order);
      } else {
        spdlog::warn("request refused: {}", refusal.reason);
        replies.write(refusal);
      }
    }));
    readers.push_back(bus.reader(dds::kStop, [on_stop](const dds::Stop& stop) {
      spdlog::error("stop: {}", stop.reason);
      on_stop();
    }));
    std::vector<std::string> groups = armNames(setup.robot);
    if (groups.size() >= 2)
      groups.push_back(dds::kPair);
    for (const std::string& group : groups) {
      readers.push_back(bus.reader(dds::kStateCommand, group, [this, group, on_order](const auto& command) {
        std::string refusal;
        auto order = desk.parse(group, command, refusal);
        if (!order)
          return spdlog::warn("{}", refusal);
        if (order->arm != dds::kAllArms || robot.armCount() == 2)
          return on_order(*order);
        for (order->arm = 0; order->arm < 2; ++order->arm)  // the pair of a robot with more arms
          on_order(*order);
      }));
    }
    clock.emplace(bus, setup);
  }

  /// Calls `tell` with every new fault of an arm.
  template <class Tell>
  void tellFaults(FaultWatch& watch, Tell tell) const noexcept {
    for (int k = 0; k < robot.armCount(); ++k) {
      if (watch.fresh(k, core.faultRecord(k)))
        tell(FaultReport{k, core.faultRecord(k)});
    }
  }

  /// Not for the periodic thread.
  void tellIdle(const IdleReport& report) const {
    const std::string& arm = setup.robot.arms[static_cast<std::size_t>(report.arm)].name;
    if (report.powered_off) {
      spdlog::warn("{}: power off: nobody has commanded it for {:.0f} s", arm, report.idle);
    } else {
      spdlog::warn(
          "{}: has had power for {:.0f} s without a commander, and keeps it: its axes are not declared to hold without "
          "(holds_without_power in the hardware file); disable it",
          arm, report.idle);
    }
  }

  /// What the thread that publishes for people shall say. @param m  of the periodic thread
  void fillMoment(std::int64_t now,
                  const dds::ActuationState& state,
                  const CycleOutput& output,
                  Moment& m) const noexcept {
    m.state = state;
    m.status = output.status;
    m.commanded = output.command.velocity;
    m.faults = core.faultRecords();
    core.fillMoments(now, m.operators, m.crtk);
  }

  void publish(const Moment& m) {
    crtk.publish(m);
    operators.publish(m.status, m.operators, m.crtk);
  }

  void answer(const OrderReply& reply) {
    const dds::Reply message = desk.settle(reply);
    if (message.accepted == 0 && message.request != 0)
      spdlog::warn("request refused: {}", message.reason);
    if (message.request != 0)
      replies.write(message);
  }

  const Setup& setup;
  experiments::RobotModel robot;
  OrderDesk desk;
  ControlCore core;
  CrtkDesk crtk_desk;
  dds::Bus bus;
  CrtkPublisher crtk;
  OperatorPublisher operators;
  ClearancePublisher clearance;
  dds::Writer<dds::ActuationCommand> commands;
  dds::Writer<dds::ActuationLimits> limits;
  dds::Writer<dds::ControlStatus> statuses;
  dds::Writer<dds::Reply> replies;
  std::vector<dds::Reader> readers;
  std::optional<ClockDesk> clock;
};

}  // namespace tandem::service
