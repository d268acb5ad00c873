// SPDX-License-Identifier: Apache-2.0
/** @file Simulator, control and planning connected without DDS, with a simulated clock. */
#pragma once

#include <cmath>
#include <deque>
#include <numeric>

#include "config/robot_files.h"
#include "operation/control_core.h"
#include "robots/capability.h"
#include "services/control/control_request_handler.h"
#include "services/control/object_loop.h"
#include "services/planning/planning_core.h"
#include "services/simulation/sim_core.h"

namespace tandem::test {

using Change = void (*)(config::Deployment&);  ///< of a preset, before the services are made

inline runtime::Setup makeSetup(const std::string& deployment, Change change = nullptr) {
  runtime::Setup setup;
  setup.deployment = config::loadDeployment(std::string(TANDEM_PRESETS) + "/deployments/" + deployment + ".yaml");
  if (change != nullptr)
    change(setup.deployment);
  setup.robot = config::loadAnyRobot(setup.deployment.robot);
  setup.session = runtime::randomIdentity();
  return setup;
}

/** Real-time mode, 1 kHz simulator; control at its own period. Links can be cut. */
struct System {
  explicit System(const std::string& deployment = "laptop", Change change = nullptr)
      : setup(makeSetup(deployment, change)),
        model(setup.robot, setup.deployment.model),
        handler(setup, model),
        sim(setup),
        object_loop(has(setup.robot, robots::Capability::kCommonPath)
                        ? std::make_unique<control_service::ObjectLoop>(setup)
                        : nullptr),
        control(control_service::controlSetupOf(setup, model), handler.makeTracker(), object_loop.get()),
        planning(setup) {
    control_every = std::lround(setup.deployment.control_period / setup.deployment.sim_period);
  }

  /// One millisecond.
  void tick() {
    now += 1'000'000;
    sim.step(now);
    sim.state(now, state);
    sim.status(hal);
    if (sim.tracking() && sim.measuredTips(tips) && tips_link) {
      control.onTips(tips);
      planning.onTips(tips);
    }
    if (state_link) {
      control.onState(state, ++states_arrived);
      planning.onState(state);
    }
    if (control_runs && ++ticks % control_every == 0) {
      if (planning_runs) {
        statuses.push_back(output.status);
        if (std::ssize(statuses) > planning_delay) {
          planning.onStatus(statuses.front());
          statuses.pop_front();
        }
        if (const auto reference = planning.take())
          references.push_back(*reference);
        if (std::ssize(references) > planning_delay) {
          reference_message = references.front();
          control.onReference(references.front(), ++references_arrived);
          references.pop_front();
        }
      }
      control.cycle(now, false, output);
      endings.insert(endings.end(), output.endings.outcome.begin(),
                     output.endings.outcome.begin() + output.endings.count);
      command_due = command_link ? ticks + command_delay : -1;
    }
    if (ticks == command_due) {
      sim.onCommand(output.command, now, ++commands_arrived);
      command_due = -1;
    }
  }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds * 1000); ++i)
      tick();
  }
  /// Ticks until the condition is met. @return seconds, or a negative number after `most`.
  template <class Condition>
  double until(Condition condition, double most) {
    for (int i = 0; i < static_cast<int>(most * 1000); ++i) {
      if (condition())
        return 1e-3 * i;
      tick();
    }
    return condition() ? most : -1.0;
  }

  /// Request of a client that has received the status of the last cycle.
  operation::ParsedControlRequest requestOf(dds::ControlKind kind, std::uint64_t client = 7) const {
    operation::ParsedControlRequest o;
    o.client = client;
    o.request = 1;
    o.kind = kind;
    o.control_session = output.status.session;
    o.answers_control = output.status.sequence;
    return o;
  }
  operation::ControlReply sendRequest(dds::ControlKind kind, std::uint64_t client = 7) {
    return control.onRequest(requestOf(kind, client), now);
  }
  operation::ControlReply command(safety::StateCommand command, std::uint64_t client = 7, int arm = msg::kAllArms) {
    operation::ParsedControlRequest o = requestOf(dds::ControlKind::kStateCommand, client);
    o.command = command;
    o.arm = arm;
    return control.onRequest(o, now);
  }
  dds::Reply start(const planning::TrajectorySpec& spec, std::uint64_t client = 7) {
    return startText(config::formatTrajectory(spec), client);
  }
  dds::Reply startText(const std::string& text, std::uint64_t client = 7) {
    dds::PlanningRequest request;
    request.client = client;
    request.kind = 1;
    request.trajectory = text;
    std::optional<dds::Path> path;
    return planning.onRequest(request, path);
  }
  std::uint64_t guardActions() const {
    return std::accumulate(hal.guard_count.begin(), hal.guard_count.end(), std::uint64_t{0});
  }
  bool standing() const {
    for (double v : state.velocity) {
      if (v != 0.0)
        return false;
    }
    return true;
  }
  safety::OperatingState drives(int arm) const {
    return static_cast<safety::OperatingState>(state.operating_state[static_cast<std::size_t>(arm)]);
  }
  safety::OperatingState shown(int arm) const {
    return static_cast<safety::OperatingState>(output.status.operating_state[static_cast<std::size_t>(arm)]);
  }
  /// Acquires the lease, enables, and starts a long line.
  void getMoving() {
    run(0.3);
    sendRequest(dds::ControlKind::kAcquireLease);
    command(safety::StateCommand::kEnable);
    run(0.3);
    sendRequest(dds::ControlKind::kKeepLease);
    planning::TrajectorySpec spec;
    spec.name = "line";
    spec.shape = planning::Line{{0.0, 0.02, 0.0}};
    spec.following = planning::Following::kTimed;
    spec.speed = 3e-3;
    start(spec);
    run(0.8);
    sendRequest(dds::ControlKind::kKeepLease);
  }

  runtime::Setup setup;
  robots::RobotModel model;
  control_service::ControlRequestHandler handler;
  simulation::SimCore sim;
  std::unique_ptr<control_service::ObjectLoop> object_loop;
  operation::ControlCore control;
  planning_service::PlanningCore planning;
  dds::ActuationState state;
  dds::HalStatus hal;
  dds::TipPoses tips;
  dds::PlanningReference reference_message;
  operation::CycleOutput output;
  std::deque<operation::CrtkOutcome> endings;  ///< results of motions of CRTK clients
  std::int64_t now = 1'000'000'000, ticks = 0, control_every = 100;
  std::deque<dds::ControlStatus> statuses;           ///< on the way to planning
  std::deque<dds::PlanningReference> references;     ///< on the way to control
  std::int64_t planning_delay = 0;                   ///< in control periods, each way
  std::int64_t command_delay = 0, command_due = -1;  ///< in ticks; shorter than a control period
  std::uint64_t states_arrived = 0, commands_arrived = 0, references_arrived = 0;
  bool tips_link = true, state_link = true, command_link = true, control_runs = true, planning_runs = true;
};

}  // namespace tandem::test
