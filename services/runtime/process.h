// SPDX-License-Identifier: Apache-2.0
/** @file Start of a service: command line, files, log, DDS options. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/config.h"
#include "services/dds/bus.h"
#include "services/runtime/heartbeat.h"
#include "services/runtime/stop_signal.h"

namespace CLI {
class App;
}

namespace tandem::runtime {

/** Start-up data of a service. */
struct Setup {
  std::string name;  ///< sim, control, planning
  config::Deployment deployment;
  config::Robot robot;                   ///< of any robot type: config::loadAnyRobot()
  std::uint64_t session = 0;             ///< random, new with every start
  std::shared_ptr<Heartbeat> heartbeat;  ///< of the service's loop; not null in a Setup of runService()
};

/** Another process uses the hardware that this service is to command; the message names the process. */
struct ResourceInUse : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/** Runs a service's main: parses `--deployment FILE [--log LEVEL]`, loads the files, starts the log, calls `body`,
 * which calls setup.heartbeat->beat() in every iteration of its loop and returns when `stop` is requested. Errors are
 * printed as FILE:LINE:COLUMN: KEY: MESSAGE.
 * @param more_options  adds options of this service
 * @return exit code: 0 after a stop, 1 after a failure, 2 for a wrong command line or file, 3 for ResourceInUse. */
int runService(int argc,
               char** argv,
               const std::string& name,
               const std::string& description,
               const std::function<void(const Setup&, StopSignal& stop)>& body,
               const std::function<void(CLI::App&)>& more_options = {});

/// Default deployment of all commands: environment variable TANDEM_DEPLOYMENT, else laptop.
std::string defaultDeployment();

/// Loads a deployment by file or preset. The environment variables TANDEM_DOMAIN and TANDEM_PREFIX replace its domain
/// and prefix.
/// @throw config::Error as config::loadDeployment(), and for invalid values of these variables.
config::Deployment loadDeployment(const std::string& name);

/// `--domain` and `--prefix`, which set TANDEM_DOMAIN and TANDEM_PREFIX for this process and its child processes.
void addPlaceOptions(CLI::App& app);

/// Host of the deployment that is this machine, found by its addresses. For deployments with hosts.
/// @throw std::invalid_argument if no host has an address of this machine.
const config::Host& thisHost(const config::Deployment& deployment);

/// Name of thisHost(); empty for a deployment without hosts.
std::string hostName(const config::Deployment& deployment);

/// Security role of a service: dds::Role::kHal for sim and hal, for the others the role of the same name. Used only for
/// secured deployments.
/// @throw std::invalid_argument for a name without a role.
dds::Role roleOf(const std::string& service);

/// Addresses at which participants of this deployment discover each other.
std::vector<std::string> peersOf(const config::Deployment& deployment);

/// Options of a participant of this deployment. @param role  of the process; by its name if not given
/// @throw std::invalid_argument for a secured deployment with invalid credentials of the role; names the file and the
/// remedy.
dds::BusOptions busOptions(const config::Deployment& deployment,
                           const std::string& process,
                           std::optional<dds::Role> role = std::nullopt);

/// The same for a bus of no particular robot: it publishes no identity, and accepts messages of all robots.
dds::BusOptions ofAnyRobot(dds::BusOptions options);

/// Warning for an unsecured deployment that other machines can reach; empty otherwise.
std::string exposure(const config::Deployment& deployment);

/// A random nonzero number, for sessions and client ids.
std::uint64_t randomIdentity();

}  // namespace tandem::runtime
