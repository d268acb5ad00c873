// SPDX-License-Identifier: Apache-2.0
/** @file Catheters through simulator, control and planning in lock-step, and short paths for them. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "operation/convert.h"
#include "system.h"

namespace tandem::test {

inline std::string pathText(const std::string& along, const std::string& more = "") {
  return "tandem: path/1\nname: test\nshape: line\nalong: [" + along + "]\nsize_mm: 0.5\nduration_s: 1\nhold: none\n" +
         more;
}

inline void inStep(config::Deployment& deployment) { deployment.clock = config::ClockMode::kLockStep; }

/** The same services in lock-step. */
struct Stepped : System {
  explicit Stepped(const std::string& deployment, Change change = inStep) : System(deployment, change) {
    sim.state(0, state);
    control.onState(state);
    planning.onState(state);
    publishStatus();
    sendRequest(dds::ControlKind::kAcquireLease);
    command(safety::StateCommand::kEnable);
    publishStatus();
    sim.onCommand(output.command, 0);
    receive();
    publishStatus();
  }
  /// Publishes control's status, without a step.
  void publishStatus() {
    control.cycle(now, false, output);
    planning.onStatus(output.status);
  }
  void receive() {
    sim.state(0, state);
    control.onState(state);
    planning.onState(state);
  }
  /// Steps while planning sends references. @return joints before each
  std::vector<safety::RobotVector> walk() {
    std::vector<safety::RobotVector> all;
    for (auto reference = planning.take(); reference; reference = planning.take()) {
      reference_message = *reference;
      control.onReference(*reference);
      if (!control.readyToAdvance())
        break;
      safety::RobotVector q;
      dds::measuredJoints(state, model.armCount(), model.jointCount(), q);
      all.push_back(q);
      control.cycle(now, true, output);
      planning.onStatus(output.status);
      sim.onCommand(output.command, 0);
      receive();
    }
    return all;
  }
  planning::Phase phase() const { return static_cast<planning::Phase>(reference_message.phase); }
};

}  // namespace tandem::test
