// SPDX-License-Identifier: Apache-2.0
/** @file tandem-discovery: introduces the processes of a deployment to one another. It carries no data: who has met
 * goes on without it. */
#include <spdlog/spdlog.h>

#include <stdexcept>

#include "services/runtime/process.h"

using namespace tandem;

namespace {

void run(const service::Setup& setup, service::StopSignal& stop) {
  dds::BusOptions options = service::busOptions(setup.deployment, setup.name);
  if (!options.discovery)
    throw std::invalid_argument(setup.deployment.file.string() + ": has no `discovery`, expected a server to be");
  options.discovery->serve = true;
  const dds::Bus bus(options);
  spdlog::info("ready: discovery server on {}:{}", options.discovery->address, options.discovery->port);
  constexpr double kLook = 0.2;  // s
  do {
    setup.heartbeat->beat();
  } while (!stop.waitFor(kLook));
}

}  // namespace

int main(int argc, char** argv) {
  return service::runService(argc, argv, "discovery", "Introduces the processes of a deployment to one another.", run);
}
