// SPDX-License-Identifier: Apache-2.0
/** @file tandem-discovery: DDS discovery server of a deployment. It carries no data; processes that have discovered
 * each other do not need it. */
#include <spdlog/spdlog.h>

#include <stdexcept>

#include "services/runtime/process.h"

using namespace tandem;

namespace {

void run(const runtime::Setup& setup, runtime::StopSignal& stop) {
  dds::BusOptions options = runtime::busOptions(setup.deployment, setup.name);
  if (!options.discovery)
    throw std::invalid_argument(setup.deployment.file.string() +
                                ": key `discovery` is missing; tandem-discovery needs it");
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
  return runtime::runService(argc, argv, "discovery", "DDS discovery server of a deployment.", run);
}
