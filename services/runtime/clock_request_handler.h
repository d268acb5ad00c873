// SPDX-License-Identifier: Apache-2.0
/** @file Clock request handler: replies with the wall clock of this host. */
#pragma once

#include "services/dds/bus.h"
#include "services/runtime/process.h"

namespace tandem::runtime {

/// Wall clock, ns since 1970.
std::int64_t wallNow() noexcept;

/** Every service has one, so that a client can compare the clocks of the hosts (services/client/clocks.h). The robot
 * does not depend on them: each process measures ages on its own clock.
 *
 * Create it after all other readers and writers of a service: they are discovered in the order of their creation, so a
 * client that has a reply has discovered all of them, and its later samples are not lost. */
class ClockRequestHandler {
 public:
  ClockRequestHandler(dds::Bus& bus, const Setup& setup);

 private:
  dds::Writer<dds::ClockReply> replies_;
  dds::Reader requests_;
};

}  // namespace tandem::runtime
