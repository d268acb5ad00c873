// SPDX-License-Identifier: Apache-2.0
/* A peer of the wire tests. Ends when its standard input closes.
 *
 *   wire_peer publish DOMAIN PREFIX SEED   writes patterns on actuation/state and arm_a/measured_js, every 2 ms
 *   wire_peer planning DOMAIN PREFIX       lock-step: answers every state with a reference
 *   wire_peer control DOMAIN PREFIX        lock-step: answers every reference with a command
 */
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "pattern.h"
#include "services/dds/bus.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::dds {
namespace {

bool inputClosed(int milliseconds) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char byte = 0;
  return poll(&input, 1, milliseconds) == 1 && read(STDIN_FILENO, &byte, 1) <= 0;
}

void publish(Bus& bus, unsigned seed) {
  auto state = bus.writer(kActuationState);
  auto joints = bus.writer(kMeasuredJs, "arm_a");
  runtime::PeriodicLoop loop(2e-3);
  loop.run([&](const runtime::Tick& tick) {
    state.write(patternState(seed, tick.cycle));
    joints.write(patternJoints(seed, tick.cycle));
    return !inputClosed(0);
  });
}

void planning(Bus& bus) {
  auto writer = bus.writer(kPlanningReference);
  PlanningReference reference;
  auto reader = bus.reader(kActuationState, [&](const ActuationState& state) {
    reference.sequence = state.sequence;
    reference.answers_state = state.sequence;
    writer.write(reference);
  });
  while (!inputClosed(1000)) {
  }
}

void control(Bus& bus) {
  auto writer = bus.writer(kActuationCommand);
  ActuationCommand command;
  auto reader = bus.reader(kPlanningReference, [&](const PlanningReference& reference) {
    command.sequence = reference.sequence;
    command.answers_state = reference.answers_state;
    writer.write(command);
  });
  while (!inputClosed(1000)) {
  }
}

int run(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (argc < 4 || (mode == "publish" && argc < 5)) {
    std::fprintf(stderr, "usage: wire_peer publish|planning|control DOMAIN PREFIX [SEED]\n");
    return 2;
  }
  BusOptions options;
  options.name = "wire_peer";
  options.domain = std::atoi(argv[2]);
  options.prefix = argv[3];
  options.deterministic = mode != "publish";
  Bus bus(options);
  if (mode == "publish") {
    publish(bus, static_cast<unsigned>(std::strtoul(argv[4], nullptr, 10)));
  } else if (mode == "planning") {
    planning(bus);
  } else {
    control(bus);
  }
  return 0;
}

}  // namespace
}  // namespace tandem::dds

int main(int argc, char** argv) {
  try {
    return tandem::dds::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wire_peer: %s\n", error.what());
    return 1;
  }
}
