// SPDX-License-Identifier: Apache-2.0
/** @file Security role of a client: operator or viewer. */
#pragma once

#include <CLI/CLI.hpp>

#include "config/config.h"
#include "services/dds/bus.h"

namespace tandem::client {

/// `tandem --role operator|viewer`, or TANDEM_ROLE in the environment; for all subcommands.
void addRoleOption(CLI::App& app);

/// The requested role. Without a request: operator, or viewer if the deployment is secured and has only viewer
/// credentials.
dds::Role localRole(const config::Deployment& deployment);

/// Options of a client's participant.
dds::BusOptions clientOptions(const config::Deployment& deployment);

}  // namespace tandem::client
