// SPDX-License-Identifier: Apache-2.0
/** @file Replies to requests. */
#pragma once

#include <string>
#include <utility>

#include "services/dds/messages.h"

namespace tandem::dds {

/// Reply to a client's request; accepted if `code` is kOk.
template <class Request>
Reply replyTo(const Request& request, ReplyCode code, std::string reason, std::uint32_t value = 0) {
  const std::uint8_t accepted = code == ReplyCode::kOk ? 1 : 0;
  return {request.client, request.request, accepted, static_cast<std::uint16_t>(code), std::move(reason), value};
}

}  // namespace tandem::dds
