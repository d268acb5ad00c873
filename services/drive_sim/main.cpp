// SPDX-License-Identifier: Apache-2.0
/** @file tandem-drive-sim: simulated CANopen drives and encoders on a CAN bus. */
#include <poll.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <array>
#include <iostream>
#include <map>
#include <optional>

#include "hal/can/clock.h"
#include "services/drive_sim/bus_spec.h"
#include "services/drive_sim/control_socket.h"
#include "services/drive_sim/report.h"
#include "services/runtime/log.h"
#include "services/runtime/stop_signal.h"

using namespace tandem;

namespace {

struct Options {
  std::string bus, control, send, hardware, hardware_bus, encoder_eds, level;
  std::vector<std::string> drives, encoders, drive_eds;
  std::uint32_t seed = 1;
  sim::drives::Habits habits;
  double answer_delay = 0.0;  // ms
  double play = 0.0;          // counts
};

void addOptions(CLI::App& app, Options& options) {
  app.add_option("--bus", options.bus, "can:INTERFACE, or unix:SOCKET (this process is then its hub)");
  app.add_option("--hardware", options.hardware, "hardware file, or the name of a preset: simulate one of its buses");
  app.add_option("--hardware-bus", options.hardware_bus, "name of that bus in the file; --bus overrides its interface");
  app.add_option(
         "--drive", options.drives,
         "ID[,serial=N][,start=COUNTS][,low=COUNTS][,high=COUNTS][,max_velocity=N][,max_acceleration=N]"
         "[,incremental], and places of switches in counts: [,negative_switch=N][,positive_switch=N][,home_from=N]"
         "[,home_to=N][,index=N] (default: limit switches at low and high); may be repeated")
      ->delimiter('\0');
  app.add_option("--encoder", options.encoders, "ID=DRIVE[,serial=N][,ratio=X][,offset=N]; may be repeated")
      ->delimiter('\0');
  app.add_option("--drive-eds", options.drive_eds,
                 "EDS file of the drives (default: built in); NODE[,NODE...]=FILE for some of them; may be repeated")
      ->delimiter('\0');
  app.add_option("--encoder-eds", options.encoder_eds, "EDS file of the encoders (default: built in)");
  using sim::drives::AnswerForm;
  app.add_option("--answers", options.habits.answers,
                 "form of the drives' answers to SDO reads: sized; unsized: four bytes without their number (0x42); "
                 "four-bytes: a number of one or two bytes in four (0x43)")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, AnswerForm>{
              {"sized", AnswerForm::kSized}, {"unsized", AnswerForm::kUnsized}, {"four-bytes", AnswerForm::kFourBytes}},
          CLI::ignore_case))
      ->option_text("FORM");
  app.add_option("--answer-delay-ms", options.answer_delay, "time that the drives take for an SDO answer")
      ->check(CLI::Range(0.0, 60e3));
  app.add_flag("--late-mode-display", options.habits.late_mode_display,
               "the drives show a new mode of operation (6061) only in operation enabled");
  app.add_option("--rounding", options.habits.rounding,
                 "the drives keep speeds and accelerations as multiples of this, in their own units")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000}));
  app.add_option("--play", options.play, "free travel between each motor and its encoder, counts of the motor")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--control", options.control, "socket that receives commands while the simulation runs");
  app.add_option(
      "--send", options.send,
      "send one command to the --control socket of a running instance, print the reply, exit: state | mark | "
      "inject NODE FAULT [VALUE] [for SECONDS] | clear NODE [FAULT] | turn NODE COUNTS; node 0 is the bus");
  app.add_option("--seed", options.seed, "seed of random losses and bit flips")->capture_default_str();
  app.add_option("--log", options.level, "trace, debug, info, warn, error or off (default: TANDEM_LOG, else info)");
  app.footer("Without --drive, --encoder and --hardware: drives 1 to 6, encoders 17 to 22.");
}

/// A data sheet; what is odd in it is logged.
hal::canopen::Eds loadSheet(const std::string& path) {
  hal::canopen::Eds eds = hal::canopen::loadEds(path);
  for (const hal::canopen::FileWarning& warning : eds.warnings)
    spdlog::warn("{}", describe(eds, warning));
  return eds;
}

sim::drives::BusSpec specOf(Options& options) {
  sim::drives::BusSpec spec;
  spec.seed = options.seed;
  for (const std::string& sheet : options.drive_eds)
    drive_sim::addSheet(sheet, loadSheet, spec);
  if (!options.encoder_eds.empty())
    spec.encoder_eds = loadSheet(options.encoder_eds);
  if (!options.hardware.empty()) {
    const hal::HardwareConfig hardware = config::loadHardware(config::findFile(options.hardware, "hardware"));
    if (!hardware.simulated)
      spdlog::warn("hardware {} is not marked as simulated: make sure that no real drive is on this bus",
                   hardware.name);
    drive_sim::addNodes(hardware, options.hardware_bus, spec);
    for (const hal::BusConfig& bus : hardware.buses) {
      if (bus.name == options.hardware_bus && options.bus.empty())
        options.bus = bus.address;
    }
  }
  for (const std::string& drive : options.drives)
    spec.drives.push_back(drive_sim::parseDrive(drive));
  for (const std::string& encoder : options.encoders)
    spec.encoders.push_back(drive_sim::parseEncoder(encoder));
  if (spec.drives.empty() && spec.encoders.empty())
    drive_sim::addStandardNodes(spec);
  options.habits.answer_delay = static_cast<std::int64_t>(1e6 * options.answer_delay);
  for (sim::drives::DriveSpec& drive : spec.drives) {
    drive.habits = options.habits;
    drive.load.play = options.play;
  }
  for (sim::drives::EncoderSpec& encoder : spec.encoders)
    encoder.play = options.play;
  return spec;
}

void run(Options& options, runtime::StopSignal& stop) {
  constexpr int kPeriod = 1;  // ms
  const sim::drives::BusSpec spec = specOf(options);
  // This process is the hub of a socket bus, which other processes join: without drives there is no bus.
  if (options.bus.starts_with("unix:"))
    options.bus.replace(0, 5, "unix-hub:");
  const auto bus = hal::can::openBus(options.bus);
  sim::drives::DriveBus simulation(*bus, spec, hal::can::monotonicNow());
  std::optional<drive_sim::ControlSocket> control;
  if (!options.control.empty())
    control.emplace(options.control);
  spdlog::info("ready: {} drives, {} encoders on {}", spec.drives.size(), spec.encoders.size(), bus->name());
  std::array<pollfd, 3> sources{{{bus->fd(), POLLIN, 0}, {stop.fd(), POLLIN, 0}, {-1, POLLIN, 0}}};
  if (control)
    sources[2].fd = control->fd();
  hal::can::BusState state = bus->state();
  while (!stop.requested()) {
    poll(sources.data(), sources.size(), kPeriod);
    simulation.poll(hal::can::monotonicNow());
    if (control)
      control->poll([&](const std::string& line) {
        spdlog::debug("control: {}", line);
        return drive_sim::serveLine(simulation, line);
      });
    if (bus->state() != state) {
      state = bus->state();
      spdlog::warn("bus: {}", name(state));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulated CANopen drives (CiA 402) and absolute encoders (CiA 406) on a CAN bus.", "tandem-drive-sim");
  Options options;
  addOptions(app, options);
  try {
    app.parse(argc, argv);
    if (!options.send.empty()) {
      const std::string answer = drive_sim::askControl(options.control, options.send);
      std::cout << answer << '\n';
      return answer.starts_with("error") ? 1 : 0;
    }
    if (options.bus.empty() && options.hardware.empty())
      throw CLI::RequiredError("--bus or --hardware");
    if (options.hardware.empty() != options.hardware_bus.empty())
      throw CLI::ValidationError("--hardware, --hardware-bus", "found one of them, expected both");
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::cerr << "tandem-drive-sim: " << error.what() << '\n';
    return 1;
  }
  runtime::StopSignal stop;
  int code = 0;
  try {
    runtime::startLog("drive-sim", options.level);
    run(options, stop);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    const bool configuration = dynamic_cast<const config::Error*>(&error) != nullptr ||
                               dynamic_cast<const std::invalid_argument*>(&error) != nullptr ||
                               dynamic_cast<const hal::canopen::IniError*>(&error) != nullptr;
    code = configuration ? 2 : 1;
  }
  runtime::stopLog();
  return code;
}
