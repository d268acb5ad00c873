// SPDX-License-Identifier: Apache-2.0
/** @file tandem-recorder: the black box of a robot. */
#include <spdlog/spdlog.h>

#include <cstdio>

#include "config/arm_names.h"
#include "services/recorder/black_box.h"
#include "services/recordings/capture.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"

using namespace tandem;

namespace {

std::string oneDecimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

void report(runtime::Diagnostics& diagnostics, const recorder::BlackBox& box, const recordings::Capture& capture) {
  using Level = runtime::Diagnostics::Level;
  const recorder::BlackBox::Status status = box.status();
  Level level = Level::kOk;
  std::string message = "records";
  if (!status.problem.empty()) {
    level = Level::kError;
    message = status.problem;
  } else if (status.too_small) {
    level = Level::kWarn;
    message = "black_box.memory_mb is too small: it holds " + oneDecimal(status.held) + " s";
  }
  const std::int64_t now = runtime::monotonicNow();
  diagnostics.publish(now, level, message,
                      {{"held_s", oneDecimal(status.held)},
                       {"received", std::to_string(capture.received())},
                       {"lost", std::to_string(capture.lost())},
                       {"faults", std::to_string(status.faults)},
                       {"last_event", status.last_event},
                       {"files", std::to_string(status.files)},
                       {"last_file", status.last_file}});
}

void run(const runtime::Setup& setup, runtime::StopSignal& stop) {
  // Bytes need a separate bus, besides the one for diagnostics.
  dds::Bus bus(runtime::busOptions(setup.deployment, setup.name));
  dds::Bus bytes(
      runtime::ofAnyRobot(runtime::busOptions(setup.deployment, setup.name + "-bytes", dds::Role::kRecorder)));
  runtime::Diagnostics diagnostics(bus, setup);
  const runtime::ClockRequestHandler clock(bus, setup);
  std::vector<std::string> wanted = setup.deployment.black_box.topics;
  wanted.insert(wanted.end(), recorder::FaultTrigger::kTopics.begin(), recorder::FaultTrigger::kTopics.end());
  recorder::BlackBox box(setup.deployment, setup.robot,
                         recordings::chooseTopics(dds::allTopics(config::armList(setup.robot)), wanted));
  recordings::Capture capture(bytes, box.topics(),
                              [&](const auto& tag, std::string_view sample) { box.take(tag, sample); });
  spdlog::info("ready: {} topics, files in {}", box.topics().size(),
               recorder::blackBoxDirectory(setup.deployment).string());
  do {
    setup.heartbeat->beat();
    report(diagnostics, box, capture);
  } while (!stop.waitFor(0.5));
}

}  // namespace

int main(int argc, char** argv) {
  return runtime::runService(argc, argv, "recorder",
                             "Black box: keeps the last seconds in memory, and writes them to a file on a fault.", run);
}
