// SPDX-License-Identifier: Apache-2.0
/** @file Validation of messages against the ranges of the IDL: counts beyond capacity, indices beyond arrays, oversized
 * texts and lists.
 *
 * Checked before a message is written and after it is read, so that consumers need not. Consumers check values (finite,
 * recent, in sequence, inside limits).
 */
#pragma once

#include <cstddef>

#include "services/dds/messages.h"

namespace tandem::dds {

inline constexpr std::size_t kMaxText = 64 * 1024;           ///< bytes of a text, unless the IDL says otherwise
inline constexpr std::size_t kMaxList = 64 * 1024;           ///< elements of a list likewise
inline constexpr std::size_t kMaxPayload = 4 * 1024 * 1024;  ///< bytes of an encoded sample
/// Bytes of each buffer that DDS reserves for samples of types without a fixed size; a longer sample enlarges its
/// buffer. For the size that a diagnostic_msgs/DiagnosticArray can have, the 65 buffers of one writer would be 340 MB.
inline constexpr std::uint32_t kUsualPayload = 4096;

/// First defect of a message; nullptr if none.
template <class M>
const char* malformed(const M& message);

}  // namespace tandem::dds
