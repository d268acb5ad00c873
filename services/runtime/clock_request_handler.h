// SPDX-License-Identifier: Apache-2.0
/** @file Clock service: answers requests for the time of this host. */
#pragma once

#include "services/dds/bus.h"
#include "services/runtime/process.h"

namespace tandem::runtime {

/// Wall clock, ns since 1970.
std::int64_t wallNow() noexcept;

/** Every service has one, so that a client can compare the clocks of the hosts (services/client/clocks.h). Nothing of
 * the robot depends on them: ages are judged on the clock of whoever judges.
 *
 * It has to be the last of a service's ends: others discover them in the order in which they were made, so a client
 * that has an answer has found all of them, and what it writes then is not lost. */
class ClockRequestHandler {
 public:
  ClockRequestHandler(dds::Bus& bus, const Setup& setup);

 private:
  dds::Writer<dds::ClockReply> replies_;
  dds::Reader requests_;
};

}  // namespace tandem::runtime
