// SPDX-License-Identifier: Apache-2.0
/** @file Untyped topics: samples as serialized bytes, for recording, replay and bridges.
 *
 * One Bus can use a type either as messages or as bytes: create a separate Bus for the bytes. Bytes are CDR after its
 * four bytes of encapsulation, as on the wire.
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

/** One received sample; `bytes` is valid during the callback. */
struct RawSample {
  std::string_view bytes;
  std::int64_t source_time = 0;           ///< ns since the epoch, on the writer's clock
  std::uint64_t sequence = 0;             ///< of this writer, counts from 1 without gaps
  std::array<std::uint8_t, 16> writer{};  ///< unique identity (GUID) of the writer
  bool own = false;                       ///< the writer is one of this bus
};

/** Writes bytes, otherwise as Writer. */
class RawWriter {
 public:
  /// @param topic  its name (with the arm, below the prefix), type and profile are used; it need not be in the table
  /// @throw as Bus::writer()
  RawWriter(Bus& bus, const TopicInfo& topic);

  /// @return false if the bytes are no CDR of at most kMaxPayload bytes, or DDS refused them.
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

/// Decodes a message; empty if the bytes cannot be decoded or are malformed (validate.h).
template <class M>
std::optional<M> decode(std::string_view bytes);

/// Encodes a message.
template <class M>
std::string encode(const M& message);

}  // namespace tandem::dds
