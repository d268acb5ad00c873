// SPDX-License-Identifier: Apache-2.0
/** @file tandem can budget, log and replay. */
#include <poll.h>

#include <array>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/config.h"
#include "hal/can/candump.h"
#include "hal/can/clock.h"
#include "services/cli/can/can.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

nlohmann::ordered_json budgetJson(const hal::HardwareConfig& hardware, std::size_t b, double heartbeat) {
  const hal::BusPlan plan = hardware.planOf(static_cast<int>(b), heartbeat);
  const hal::BusLoad load = hal::computeLoad(plan);
  nlohmann::ordered_json streams = nlohmann::ordered_json::array();
  for (const hal::FrameStream& stream : plan.streams)
    streams.push_back({{"what", stream.what},
                       {"data_bytes", stream.data_bytes},
                       {"bits", hal::frameBits(stream.data_bytes)},
                       {"frames_per_cycle", stream.frames_per_cycle},
                       {"frames_per_second", stream.frames_per_second}});
  return {{"bus", hardware.buses[b].name},
          {"bit_rate", plan.bit_rate},
          {"period_s", plan.period},
          {"frames_per_cycle", load.frames_per_cycle},
          {"cycle_time_s", load.cycle_time},
          {"load", load.load},
          {"load_limit", plan.load_limit},
          {"shortest_period_s", load.shortest_period},
          {"fits", load.fits},
          {"text", hal::explainLoad(plan, hardware.trafficOf(static_cast<int>(b), heartbeat))},
          {"streams", streams}};
}

int budget(const CanOptions& options) {
  const double heartbeat = safety::Budgets{}.drive_heartbeat;
  const hal::HardwareConfig hardware =
      config::loadHardware(config::findFile(options.file, "hardware"), heartbeat, false);
  bool fits = true;
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (std::size_t b = 0; b < hardware.buses.size(); ++b) {
    json.push_back(budgetJson(hardware, b, heartbeat));
    const auto& bus = json.back();
    fits = fits && bus["fits"].get<bool>();
    if (options.json)
      continue;
    std::printf("%s (%s)\n", hardware.buses[b].name.c_str(), hardware.buses[b].address.c_str());
    for (const auto& stream : bus["streams"]) {
      std::printf("  %-28s %d bytes, %3d bits, %5.1f per cycle, %6.1f per second\n",
                  stream["what"].get<std::string>().c_str(), stream["data_bytes"].get<int>(), stream["bits"].get<int>(),
                  stream["frames_per_cycle"].get<double>(), stream["frames_per_second"].get<double>());
    }
    std::printf("  per cycle: %.0f frames, %.3f ms of %.3g ms on the wire\n  %s: %s\n",
                bus["frames_per_cycle"].get<double>(), 1e3 * bus["cycle_time_s"].get<double>(),
                1e3 * bus["period_s"].get<double>(), bus["fits"].get<bool>() ? "fits" : "DOES NOT FIT",
                bus["text"].get<std::string>().c_str());
  }
  if (options.json)
    std::cout << json.dump(2) << '\n';
  else
    std::printf(
        "counted: the longest frames (most stuff bits), all heartbeats, and the SDO requests that the plan permits "
        "while "
        "an arm has power; tandem can monitor shows the frames of the last second, with as many bits each\n");
  return fits ? kOk : kFailure;
}

/// Waits for frames, the stop signal, or the deadline. @return false after a stop signal
bool waitFor(const hal::can::Bus& bus, const runtime::StopSignal& stop, int milliseconds) {
  std::array<pollfd, 2> sources{{{bus.fd(), POLLIN, 0}, {stop.fd(), POLLIN, 0}}};
  poll(sources.data(), sources.size(), milliseconds);
  return !stop.requested();
}

std::string interfaceName(const std::string& address) {
  const std::size_t cut = address.find_last_of(":/");
  return cut == std::string::npos ? address : address.substr(cut + 1);
}

int record(const CanOptions& options) {
  runtime::StopSignal stop;
  CanTool tool(options);
  std::ofstream file;
  if (!options.file.empty()) {
    file.open(options.file);
    if (!file)
      client::failToWrite(kUsage, options.file);
  }
  std::ostream& out = options.file.empty() ? std::cout : file;
  hal::can::LogWriter writer(out, interfaceName(options.bus));
  constexpr int kLook = 50;  // ms
  const std::int64_t begin = hal::can::monotonicNow();
  std::array<hal::can::CanFrame, 64> frames;
  std::uint64_t count = 0;
  while (waitFor(tool.bus(), stop, kLook)) {
    for (std::size_t got = frames.size(); got == frames.size(); count += got) {
      got = tool.bus().receive(frames);
      for (std::size_t i = 0; i < got; ++i)
        writer.write(frames[i], hal::can::realtimeOffset());
    }
    if (options.seconds > 0.0 && 1e-9 * static_cast<double>(hal::can::monotonicNow() - begin) > options.seconds)
      break;
  }
  if (!out.flush())
    client::failToWrite(kFailure, options.file.empty() ? "standard output" : options.file);
  if (client::asJson() && !options.file.empty())
    answer("", {{"frames", count}, {"lost", tool.bus().counters().rx_overflow}});
  std::cerr << count << " frames, " << tool.bus().counters().rx_overflow << " lost\n";
  return tool.bus().counters().rx_overflow == 0 ? kOk : kFailure;
}

int replay(const CanOptions& options) {
  runtime::StopSignal stop;
  std::vector<hal::can::LogEntry> entries;
  try {
    entries = hal::can::readLogFile(options.file);
  } catch (const std::exception& error) {
    throw Failure(kUsage, error.what());
  }
  CanTool tool(options);
  tool.refuseBesideMaster();
  hal::can::LogReplayer replayer(std::move(entries), options.speed);
  std::size_t sent = 0;
  std::array<hal::can::CanFrame, 64> ignored;
  while (!replayer.done() && !stop.requested()) {
    sent += replayer.poll(tool.bus(), hal::can::monotonicNow());
    while (tool.bus().receive(ignored) == ignored.size()) {
    }
    const std::int64_t wait = (replayer.nextTime() - hal::can::monotonicNow()) / 1'000'000;
    if (!replayer.done())
      stop.waitFor(1e-3 * static_cast<double>(std::clamp<std::int64_t>(wait, 0, 100)));
  }
  if (client::asJson())
    answer("", {{"sent", sent}, {"complete", replayer.done()}});
  std::cerr << sent << " frames sent\n";
  return replayer.done() ? kOk : kFailure;
}

}  // namespace

void registerCanTools(CLI::App& can, const std::shared_ptr<CanOptions>& options, int& exit_code) {
  const auto add = [&](const std::string& name, const std::string& text, int (*run)(const CanOptions&)) {
    CLI::App* command = can.add_subcommand(name, text);
    command->callback([options, run, &exit_code] { guarded(exit_code, [&] { return run(*options); }); });
    return command;
  };
  CLI::App* calculator =
      add("budget", "worst-case bus load of a hardware file, and whether it is within the limit", budget);
  calculator->add_option("file", options->file, "hardware file or preset")->required();
  calculator->add_flag("--json", options->json, "JSON instead of text");
  CLI::App* recorder = add("log", "record a bus in candump's log format", record);
  recorder->add_option("-b,--bus", options->bus, "can:INTERFACE or unix:SOCKET")->required();
  recorder->add_option("-o,--out", options->file, "file (default: standard output)");
  recorder->add_option("--for", options->seconds, "stop after this many seconds")->check(client::kPositive);
  CLI::App* player = add("replay", "send a recorded log with its original timing", replay);
  player->add_option("file", options->file, "candump log")->required();
  player->add_option("-b,--bus", options->bus, "can:INTERFACE or unix:SOCKET")->required();
  player->add_option("--speed", options->speed, "speed factor; 2: twice as fast as recorded")
      ->capture_default_str()
      ->check(client::kPositive);
  player->add_flag("--force", options->force, "run even if a master is active on the bus");
}

}  // namespace tandem::cli
