// SPDX-License-Identifier: Apache-2.0
/** @file tandem up: the processes of a deployment, supervised. */
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/robot_files.h"
#include "services/cli/deployment/place.h"
#include "services/cli/deployment/supervisor.h"
#include "services/cli/robot/console.h"
#include "services/client/arguments.h"
#include "services/client/client.h"
#include "services/runtime/identity.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

struct UpCommand {
  std::string deployment = service::defaultDeployment(), log;
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
void tell(const UpCommand& options,
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

/// The next death that ends the deployment, if any; others are reported, and that is all.
std::optional<DeadProcess> fatalDeath(const UpCommand& options, Supervisor& supervisor) {
  std::optional<DeadProcess> dead = supervisor.poll();
  while (dead && !dead->essential) {
    tell(options, "lost", dead->describe() + "; the others go on without it",
         {{"process", dead->name}, {"pid", dead->pid}, {"status", dead->status}});
    dead = supervisor.poll();
  }
  return dead;
}

/// Says why everything ends until the black box has it, where the deployment has one that lives.
void keepReason(const config::Deployment& deployment,
                const DeadProcess& dead,
                Client& client,
                const std::string& reason) {
  constexpr int kTries = 4;
  constexpr double kPeriod = 1.0;  // s: twice that of the recorder's diagnostics
  const bool recorded = std::ranges::any_of(deployment.processes, [&](const config::Process& process) {
    return process.executable == "tandem-recorder" && process.name != dead.name;
  });
  const auto kept = [&](const Snapshot& s) {
    const auto said = s.diagnostics.find("tandem-recorder");
    return said != s.diagnostics.end() && std::ranges::any_of(said->second.values, [&](const dds::KeyValue& pair) {
             return pair.key == "last_event" && pair.value == "stop: " + reason;
           });
  };
  for (int i = 0; i < kTries; ++i) {
    client.say(reason);
    if (!recorded || client.waitFor(kPeriod, kept))
      return;
  }
}

/// After a death: lets the robot stop by its own watchdogs, says how long that took, and has the black box keep it.
void watchStandstill(const UpCommand& options,
                     const config::Deployment& deployment,
                     const DeadProcess& dead,
                     Client& client) {
  tell(options, "died", dead.describe(), {{"process", dead.name}, {"pid", dead.pid}, {"status", dead.status}});
  const std::string reason = "tandem up: " + dead.describe();
  if (dead.name == "sim" || dead.name == "hal")
    return keepReason(deployment, dead, client, reason);  // no drives are left that could stand
  const auto start = Clock::now();
  const double budget =
      std::max(deployment.budgets.commandAge(deployment.control_period), deployment.budgets.planning_reference) + 1.0;
  const std::uint64_t received = client.snapshot().states;
  const bool stands =
      client.waitFor(budget, [&](const Snapshot& s) { return s.states > received && standing(s.state); });
  if (stands) {
    tell(options, "standing", "the robot stands, " + std::to_string(since(start)) + " s later",
         {{"seconds", since(start)}});
    return keepReason(deployment, dead, client, reason);
  }
  tell(options, "moving", "the robot does not stand after " + std::to_string(budget) + " s: sending stop");
  client.stop(reason);
  client.waitFor(1.0, [](const Snapshot& s) { return standing(s.state); });
}

/// Waits until all processes know of each other; as long as it takes, where some are on other hosts.
/// @return false where `ended` said so. @throw Failure naming who is silent.
bool meet(const UpCommand& options,
          const config::Deployment& deployment,
          const std::string& host,
          Client& client,
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
      tell(options, "waiting", "waiting for " + elsewhere + "; start it with `tandem up` there");
      if (!service::mismatches(client.bus()).empty())
        tell(options, "mismatch", failure.what());
    }
  }
}

bool runs(const Supervisor& supervisor, const std::string& name) {
  return std::ranges::any_of(supervisor.children(), [&](const Supervisor::Child& child) { return child.name == name; });
}

/// Waits until those that were started here have said who they are; others do not count. @return who has not: ",
/// control"
std::string ownUnheard(const Supervisor& supervisor, Client& client) {
  constexpr double kPatience = 15.0;  // s
  std::string unheard;
  client.waitFor(kPatience, [&](const Snapshot&) {
    const std::vector<dds::Identity> others = client.bus().others();
    unheard.clear();
    for (const Supervisor::Child& child : supervisor.children()) {
      const bool reported = std::ranges::any_of(
          others, [&](const dds::Identity& other) { return other.pid == static_cast<std::uint32_t>(child.pid); });
      if (child.is_service && child.essential && !reported)
        unheard += ", " + child.name;
    }
    return unheard.empty();
  });
  return unheard;
}

/// Waits until the console, which speaks once it serves, has spoken. @return false where it has ended instead.
bool serves(const Supervisor& supervisor, Client& client, const std::string& name) {
  constexpr double kPatience = 5.0;  // s
  const auto spoke = [](const Snapshot& s) { return s.diagnostics.contains("tandem-console"); };
  client.waitFor(kPatience, [&](const Snapshot& s) { return spoke(s) || !runs(supervisor, name); });
  return runs(supervisor, name) && spoke(client.snapshot());
}

int runUp(const UpCommand& options) {
  const config::Deployment deployment = service::loadDeployment(options.deployment);
  config::loadAnyRobot(deployment.robot);  // refused here, once, rather than by every process
  const std::string host = service::hostName(deployment);
  service::StopSignal stop;
  const PlaceLock place(deployment, host);
  Supervisor supervisor(deployment, host, options.log);
  if (supervisor.children().empty())
    throw Failure(kUsage,
                  deployment.file.string() + ": processes: none of them runs on host '" + host + "', which is here");
  nlohmann::ordered_json pids;
  std::string text = deployment.name + (host.empty() ? ":" : " on " + host + ":");
  for (const Supervisor::Child& child : supervisor.children()) {
    pids[child.name] = child.pid;
    text += " " + child.name + " (pid " + std::to_string(child.pid) + ")";
  }
  tell(options, "started", text, {{"pids", pids}});
  if (const std::string warning = service::exposure(deployment); !warning.empty())
    tell(options, "exposed", warning);
  Client client(deployment);
  std::optional<DeadProcess> dead;
  client.interruptBy([&] { return stop.requested() || (!dead && (dead = fatalDeath(options, supervisor))); });
  const auto start = Clock::now();
  const auto ended = [&] { return dead || stop.requested(); };
  if (meet(options, deployment, host, client, ended)) {
    const std::string unheard = ownUnheard(supervisor, client);
    tell(options, "ready",
         "ready after " + std::to_string(since(start)) + " s; Ctrl-C stops everything" +
             (unheard.empty() ? "" : "; started here, but not found" + unheard),
         {{"seconds", since(start)}});
  }
  for (const config::Process& process : deployment.processes) {
    if (process.executable == "tandem-console" && process.host == host && serves(supervisor, client, process.name))
      tell(options, "console", "console: " + consoleUrl(deployment.console, deployment.console.port));
  }
  while (!dead && !stop.requested() && (options.seconds <= 0.0 || since(start) < options.seconds)) {
    stop.waitFor(0.01);
    dead = fatalDeath(options, supervisor);
  }
  client.interruptBy({});
  if (dead)
    watchStandstill(options, deployment, *dead, client);
  constexpr double kWriting = 10.0;  // s, for a black box of some hundred megabytes
  supervisor.stopAll(dead ? kWriting : Supervisor::kLeave);
  tell(options, "stopped", "all processes stopped");
  return dead ? kFailure : kOk;
}

}  // namespace

void registerUp(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<UpCommand>();
  CLI::App* up = app.add_subcommand("up", "start the processes of a deployment, supervise them, stop all on Ctrl-C");
  up->add_option("deployment,-d,--deployment", options->deployment,
                 "deployment file or preset: laptop, laptop-1khz, lockstep")
      ->capture_default_str();
  up->add_option("--log", options->log, "log level of the services: trace, debug, info, warn, error, off");
  up->add_option("--for", options->seconds, "stop by itself after so many seconds")->check(CLI::PositiveNumber);
  up->add_flag("--json", options->json, "one JSON object a line for each event");
  up->footer(
      "With `hosts` in the deployment, each machine starts its own; the same command on each.\nEnds with exit code 1 "
      "when a process died, after the robot has come to a stand.");
  up->callback([options, &exit_code] { guarded(exit_code, [&] { return runUp(*options); }); });
}

}  // namespace tandem::cli
