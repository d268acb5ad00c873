// SPDX-License-Identifier: Apache-2.0
/** @file tandem up: starts and supervises the processes of a deployment. */
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/robot_files.h"
#include "robots/overlap.h"
#include "services/cli/deployment/domain.h"
#include "services/cli/deployment/supervisor.h"
#include "services/cli/robot/console.h"
#include "services/cli/subcommand.h"
#include "services/client/client.h"
#include "services/runtime/identity.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

struct UpCommand {
  std::string deployment = runtime::defaultDeployment(), log;
  double seconds = 0.0;
  bool json = false;
};

using Clock = std::chrono::steady_clock;

bool standing(const dds::ActuationState& state) {
  for (double velocity : state.velocity) {
    if (velocity != 0.0)
      return false;
  }
  return true;
}

/** One event, as a line of text or of JSON. */
void report(const UpCommand& options,
            const std::string& event,
            const std::string& text,
            nlohmann::ordered_json more = {}) {
  if (options.json) {
    nlohmann::ordered_json line{{"event", event}};
    for (const auto& [key, value] : more.items())
      line[key] = value;
    line["text"] = text;
    std::cout << line.dump() << std::endl;
  } else {
    std::cout << text << std::endl;
  }
}

/// The next exit that ends the deployment, if any; other exits are only reported.
std::optional<ProcessExit> essentialExit(const UpCommand& options, Supervisor& supervisor) {
  std::optional<ProcessExit> exited = supervisor.poll();
  while (exited && !exited->essential) {
    report(options, "lost", exited->describe() + "; the other processes continue",
           {{"process", exited->name}, {"pid", exited->pid}, {"status", exited->status}});
    exited = supervisor.poll();
  }
  return exited;
}

/// Publishes the reason for the end until the black box has recorded it, if the deployment's recorder runs.
void keepReason(const config::Deployment& deployment,
                const ProcessExit& exited,
                client::Client& client,
                const std::string& reason) {
  constexpr int kTries = 4;
  constexpr double kPeriod = 1.0;  // s: twice that of the recorder's diagnostics
  const bool recorded = std::ranges::any_of(deployment.processes, [&](const config::Process& process) {
    return process.executable == "tandem-recorder" && process.name != exited.name;
  });
  const auto kept = [&](const client::Snapshot& s) {
    const auto said = s.diagnostics.find("tandem-recorder");
    return said != s.diagnostics.end() && std::ranges::any_of(said->second.values, [&](const dds::KeyValue& pair) {
             return pair.key == "last_event" && pair.value == "stop: " + reason;
           });
  };
  for (int i = 0; i < kTries; ++i) {
    client.publishStop(reason);
    if (!recorded || client.waitFor(kPeriod, kept))
      return;
  }
}

/// After an exit: waits until the watchdogs have stopped the robot, reports how long it took, and has the black box
/// record it.
void watchStandstill(const UpCommand& options,
                     const config::Deployment& deployment,
                     const ProcessExit& exited,
                     client::Client& client) {
  report(options, "died", exited.describe(),
         {{"process", exited.name}, {"pid", exited.pid}, {"status", exited.status}});
  const std::string reason = "tandem up: " + exited.describe();
  if (exited.name == "sim" || exited.name == "hal")
    return keepReason(deployment, exited, client, reason);  // no drives are left that could come to a standstill
  const auto start = Clock::now();
  const double budget =
      std::max(deployment.budgets.commandAge(deployment.control_period), deployment.budgets.planning_reference) + 1.0;
  const std::uint64_t received = client.snapshot().states;
  const bool stands =
      client.waitFor(budget, [&](const client::Snapshot& s) { return s.states > received && standing(s.state); });
  if (stands) {
    report(options, "standing", "the robot is at standstill after " + std::to_string(since(start)) + " s",
           {{"seconds", since(start)}});
    return keepReason(deployment, exited, client, reason);
  }
  report(options, "moving", "the robot is not at standstill after " + std::to_string(budget) + " s: sending stop");
  client.stop(reason);
  client.waitFor(1.0, [](const client::Snapshot& s) { return standing(s.state); });
}

/// Waits until all processes have discovered each other; without a time limit if some are on other hosts.
/// @return false if `ended` returned true. @throw Failure with the missing processes.
bool meet(const UpCommand& options,
          const config::Deployment& deployment,
          const std::string& host,
          client::Client& client,
          const std::function<bool()>& ended) {
  std::string elsewhere;
  for (const config::Process& process : deployment.processes) {
    if (process.host != host)
      elsewhere += (elsewhere.empty() ? "" : ", ") + process.name + " on " + process.host;
  }
  for (bool reported = false;;) {
    try {
      client.connect(elsewhere.empty() ? 15.0 : 5.0);
      return true;
    } catch (const Failure& failure) {
      if (ended())
        return false;
      if (elsewhere.empty())
        throw;
      if (std::exchange(reported, true))
        continue;
      report(options, "waiting", "waiting for " + elsewhere + "; start it with `tandem up` there");
      if (!runtime::mismatches(client.bus()).empty())
        report(options, "mismatch", failure.what());
    }
  }
}

bool runs(const Supervisor& supervisor, const std::string& name) {
  return std::ranges::any_of(supervisor.children(), [&](const Supervisor::Child& child) { return child.name == name; });
}

/// Waits until all essential services started here have announced themselves. @return the missing ones, as ", control"
std::string missingProcesses(const Supervisor& supervisor, client::Client& client) {
  constexpr double kTimeout = 15.0;  // s
  std::string missing;
  client.waitFor(kTimeout, [&](const client::Snapshot&) {
    const std::vector<dds::Identity> others = client.bus().others();
    missing.clear();
    for (const Supervisor::Child& child : supervisor.children()) {
      const bool reported = std::ranges::any_of(
          others, [&](const dds::Identity& other) { return other.pid == static_cast<std::uint32_t>(child.pid); });
      if (child.is_service && child.essential && !reported)
        missing += ", " + child.name;
    }
    return missing.empty();
  });
  return missing;
}

/// Waits for the first diagnostics of the console, which it publishes once it serves. @return false if it has ended.
bool serves(const Supervisor& supervisor, client::Client& client, const std::string& name) {
  constexpr double kTimeout = 5.0;  // s
  const auto spoke = [](const client::Snapshot& s) { return s.diagnostics.contains("tandem-console"); };
  client.waitFor(kTimeout, [&](const client::Snapshot& s) { return spoke(s) || !runs(supervisor, name); });
  return runs(supervisor, name) && spoke(client.snapshot());
}

int runUp(const UpCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Robot robot = config::loadAnyRobot(deployment);  // refuses an invalid file before every process does
  const std::string host = runtime::hostName(deployment);
  runtime::StopSignal stop;
  const DomainLock domain_lock(deployment, host);
  Supervisor supervisor(deployment, host, options.log);
  if (supervisor.children().empty())
    throw Failure(kUsage, deployment.file.string() + ": processes: each has another `host` than this one, '" + host +
                              "'; change `host` of a process, or start it on its host");
  nlohmann::ordered_json pids;
  std::string text = deployment.name + (host.empty() ? ":" : " on " + host + ":");
  for (const Supervisor::Child& child : supervisor.children()) {
    pids[child.name] = child.pid;
    text += " " + child.name + " (pid " + std::to_string(child.pid) + ")";
  }
  report(options, "started", text, {{"pids", pids}});
  if (const std::string warning = runtime::exposure(deployment); !warning.empty())
    report(options, "exposed", warning);
  for (const std::string& overlap : robots::describeHomeOverlaps(robot, deployment.model))
    report(options, "overlap", "warning: " + overlap);
  client::Client client(deployment);
  std::optional<ProcessExit> exited;
  client.setInterrupt([&] { return stop.requested() || (!exited && (exited = essentialExit(options, supervisor))); });
  const auto start = Clock::now();
  const auto ended = [&] { return exited || stop.requested(); };
  if (meet(options, deployment, host, client, ended)) {
    const std::string missing = missingProcesses(supervisor, client);
    report(options, "ready",
           "ready after " + std::to_string(since(start)) + " s; Ctrl-C stops everything" +
               (missing.empty() ? "" : "; started here, but not found" + missing),
           {{"seconds", since(start)}});
  }
  for (const config::Process& process : deployment.processes) {
    if (process.executable == "tandem-console" && process.host == host && serves(supervisor, client, process.name))
      report(options, "console", "console: " + consoleUrl(deployment.console, deployment.console.port));
  }
  client.rest();
  while (!exited && !stop.requested() && (options.seconds <= 0.0 || since(start) < options.seconds)) {
    stop.waitFor(0.01);
    exited = essentialExit(options, supervisor);
  }
  client.setInterrupt({});
  if (exited) {
    client.listen();
    watchStandstill(options, deployment, *exited, client);
  }
  constexpr double kWriting = 10.0;  // s, for a black box of some hundred megabytes
  supervisor.stopAll(exited ? kWriting : Supervisor::kLeave);
  report(options, "stopped", "all processes stopped");
  return exited ? kFailure : kOk;
}

}  // namespace

void registerUp(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<UpCommand>();
  CLI::App* up = app.add_subcommand("up", "start the processes of a deployment, supervise them, stop all on Ctrl-C");
  up->add_option("deployment,-d,--deployment", options->deployment,
                 "deployment file or preset: laptop, laptop-1khz, lockstep")
      ->capture_default_str();
  up->add_option("--log", options->log, "log level of the services: trace, debug, info, warn, error, off");
  up->add_option("--for", options->seconds, "stop after this many seconds")->check(client::kPositive);
  up->add_flag("--json", options->json, "one JSON object per line and event");
  up->footer(
      "With `hosts` in the deployment, run the same command on each host; it starts the processes of that host.\n"
      "Exit code 1: an essential process died; the others are stopped once the robot is at standstill.");
  up->callback([options, &exit_code] { guarded(exit_code, [&] { return runUp(*options); }); });
}

}  // namespace tandem::cli
