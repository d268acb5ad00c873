// SPDX-License-Identifier: Apache-2.0
/** @file Detection of another master on the bus. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace tandem::hal::canopen {

/** Frames that only the master of a bus sends. A bus does not return a participant's own frames, so a received one
 * comes from another master. */
enum class MasterFrame : std::uint8_t {
  kSync = 0,
  kNmt,         ///< for any node: a bus has one NMT master
  kHeartbeat,   ///< with our own node id
  kCommandPdo,  ///< an RPDO of one of our nodes
  kSdoRequest,  ///< to one of our nodes: also sent by tools that read objects, so it alone is no command
};
inline constexpr int kMasterFrameCount = 5;
std::string_view name(MasterFrame frame);  ///< "SYNC", "NMT command" ...

/** Time to listen before the first own frame, and time-out for a master that was received, s: three times the drives'
 * time-out for their master, between 0.5 and 2 s.
 *
 * A master that keeps drives in motion sends SYNC in each cycle, and a heartbeat within the drives' time-out; after a
 * longer silence the watchdogs of the drives stop them. Three, because frames get lost; 0.5 s, because the budget of
 * the other master may be larger than ours; 2 s is twice the slowest heartbeat in use, 1 s. */
double listeningTime(double heartbeat_budget) noexcept;

/** Counts the frames of other masters. Only describe() allocates. Times are ns on the caller's clock. */
class MasterWatch {
 public:
  struct Received {
    std::uint64_t count = 0;
    std::int64_t last = 0;  ///< time of the last frame
  };

  /// @param silence time-out for a master that was received, ns.
  explicit MasterWatch(std::int64_t silence) noexcept : silence_(silence) {}

  /// @return true for the first frame of its kind, or the first after a silence: to be reported.
  bool note(MasterFrame frame, std::int64_t now) noexcept;
  /// Another master commands the bus: SYNC, NMT, our heartbeat or a command PDO within the silence. SDO requests do not
  /// count.
  bool commands(std::int64_t now) const noexcept;
  /// At least one frame was received, SDO requests included.
  bool receivedAny() const noexcept;
  const Received& received(MasterFrame frame) const noexcept { return received_[static_cast<std::size_t>(frame)]; }
  /// "SYNC (125 times), command PDO (750 times)"; empty if no frame was received.
  std::string describe() const;

 private:
  bool recent(MasterFrame frame, std::int64_t now) const noexcept;

  std::int64_t silence_;
  std::array<Received, kMasterFrameCount> received_{};
};

}  // namespace tandem::hal::canopen
