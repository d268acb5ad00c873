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

/** What a service knows once it has started. */
struct Setup {
  std::string name;  ///< sim, control, planning
  config::Deployment deployment;
  config::Robot robot;                   ///< of any kind: config::loadAnyRobot()
  std::uint64_t session = 0;             ///< random, new with every start
  std::shared_ptr<Heartbeat> heartbeat;  ///< what the loop beats; always there in what runService() gives
};

/** What the service is there to command is somebody else's at present; the message says whose. */
struct ResourceInUse : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/** Runs a service's main: parses `--deployment FILE [--log LEVEL]`, loads the files, starts the log, calls `body`,
 * which beats setup.heartbeat with every round of its loop and returns when `stop` is requested. Errors are printed as
 * FILE:LINE:COLUMN: KEY: MESSAGE.
 * @param more_options  adds those that this service alone has
 * @return exit code: 0 after a stop, 1 after a failure, 2 for a wrong command line or file, 3 for ResourceInUse. */
int runService(int argc,
               char** argv,
               const std::string& name,
               const std::string& description,
               const std::function<void(const Setup&, StopSignal& stop)>& body,
               const std::function<void(CLI::App&)>& more_options = {});

/// What all commands take without a name: what TANDEM_DEPLOYMENT in the environment says, else laptop.
std::string defaultDeployment();

/// A deployment by file or preset. TANDEM_DOMAIN and TANDEM_PREFIX in the environment stand in for its domain and
/// prefix.
/// @throw config::Error as config::loadDeployment(), and for values of the environment that a file may not have either.
config::Deployment loadDeployment(const std::string& name);

/// `--domain` and `--prefix`, which set TANDEM_DOMAIN and TANDEM_PREFIX for this process and those that it starts.
void addPlaceOptions(CLI::App& app);

/// Which host of the deployment this machine is, by its addresses. For deployments with hosts.
/// @throw std::invalid_argument where it is none of them.
const config::Host& thisHost(const config::Deployment& deployment);

/// Its name; empty for a deployment without hosts.
std::string hostName(const config::Deployment& deployment);

/// What a service is there for: sim and hal are dds::Role::kHal, the others are called as their roles. Asked of secured
/// deployments alone.
/// @throw std::invalid_argument for a name that stands for no role.
dds::Role roleOf(const std::string& service);

/// Addresses at which participants of this deployment look for each other.
std::vector<std::string> peersOf(const config::Deployment& deployment);

/// Options of a participant of this deployment. @param role  of the process; by its name if not given
/// @throw std::invalid_argument where the deployment is secured and the credentials of the role are not good; names the
/// file and what to do.
dds::BusOptions busOptions(const config::Deployment& deployment,
                           const std::string& process,
                           std::optional<dds::Role> role = std::nullopt);

/// The same for a bus that belongs to no robot: it tells nothing of itself, and takes messages of all.
dds::BusOptions ofAnyRobot(dds::BusOptions options);

/// Whether others than this machine can take part although nobody has to show a certificate; what to say about that.
/// Empty where all is well.
std::string exposure(const config::Deployment& deployment);

/// A random number that is not zero: sessions and clients.
std::uint64_t randomIdentity();

}  // namespace tandem::runtime
