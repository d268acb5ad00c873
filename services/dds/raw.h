// SPDX-License-Identifier: Apache-2.0
/** @file Untyped topics: samples as serialized bytes, for recording, replay and bridges.
 *
 * A process that uses the messages of a type cannot use its bytes on the same Bus, nor the other way round: give the
 * bytes a Bus of their own. Bytes are CDR with its four bytes of encapsulation in front, as they are on the wire.
 */
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "services/dds/bus.h"
#include "services/dds/topics.h"

namespace tandem::dds {

/** One sample as it came; `bytes` belongs to the reader, for as long as the callback runs. */
struct RawSample {
  std::string_view bytes;
  std::int64_t source_time = 0;           ///< ns since the epoch, on the writer's clock
  std::uint64_t sequence = 0;             ///< of this writer, counts from 1 without gaps
  std::array<std::uint8_t, 16> writer{};  ///< identity of the writer, new with each
  bool own = false;                       ///< the writer is one of this bus
};

/** Writes bytes. As Writer otherwise. */
class RawWriter {
 public:
  /// @param topic  its name (with the arm, below the prefix), type and profile count; it need not be in the table
  /// @throw as Bus::writer()
  RawWriter(Bus& bus, const TopicInfo& topic);

  /// @return false where the bytes are no CDR of at most kMaxPayload bytes, or DDS refused them.
  bool write(std::string_view bytes) { return base_->write(&bytes); }
  int matched() const { return base_->statistics().matched; }
  WriterStatistics statistics() const { return base_->statistics(); }
  std::string lastProblem() const { return base_->lastProblem(); }

 private:
  std::unique_ptr<detail::WriterBase> base_;
};

/// Reads bytes; callbacks and lifetime as Bus::reader(). @throw as RawWriter
Reader rawReader(Bus& bus,
                 const TopicInfo& topic,
                 std::function<void(const RawSample&)> callback,
                 const ReaderOptions& options = {});

/// The message that these bytes are; nothing where they cannot be decoded or are malformed (validate.h).
template <class M>
std::optional<M> decode(std::string_view bytes);

/// The bytes of a message.
template <class M>
std::string encode(const M& message);

}  // namespace tandem::dds
