// SPDX-License-Identifier: Apache-2.0
/** @file Internal: parts of MCAP records. All functions throw std::out_of_range for bytes that end too early. */
#pragma once

#include <string_view>

#include "recording/bytes.h"
#include "recording/records.h"

namespace tandem::recording {

inline Message messageOf(std::string_view content) {
  ByteSource source(content);
  Message message;
  message.channel = source.number<std::uint16_t>();
  message.sequence = source.number<std::uint32_t>();
  message.log_time = source.number<std::uint64_t>();
  message.publish_time = source.number<std::uint64_t>();
  message.data = source.rest();
  return message;
}

/// Calls f(opcode, content) for each record of a chunk or of a summary.
template <class F>
void forEachRecord(std::string_view records, F&& f) {
  ByteSource source(records);
  while (!source.empty()) {
    const auto opcode = static_cast<Opcode>(source.number<std::uint8_t>());
    f(opcode, source.raw(source.number<std::uint64_t>()));
  }
}

}  // namespace tandem::recording
