// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/clock_request_handler.h"

#include <chrono>

namespace tandem::runtime {

std::int64_t wallNow() noexcept {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

ClockRequestHandler::ClockRequestHandler(dds::Bus& bus, const Setup& setup)
    : replies_(bus.writer(dds::kClockReply)),
      requests_(
          bus.reader(dds::kClockRequest,
                     [this, name = setup.name, host = hostName(setup.deployment)](const dds::ClockRequest& request) {
                       const std::int64_t received = wallNow();
                       replies_.write({request.client, request.request, name, host, received, wallNow()});
                     })) {}

}  // namespace tandem::runtime
