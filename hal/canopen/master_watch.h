// SPDX-License-Identifier: Apache-2.0
/** @file Detection of another master on the bus. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace tandem::hal::canopen {

/** What only the master of a bus sends. No bus hands a party its own frames, so whatever is received is somebody
 * else's.
 */
enum class MasterFrame : std::uint8_t {
  kSync = 0,
  kNmt,         ///< whomever it is for: a bus has one NMT master
  kHeartbeat,   ///< under our own node id
  kCommandPdo,  ///< an RPDO of a node of ours
  kSdoRequest,  ///< to a node of ours: tools that read objects send it, too, so it alone commands nothing
};
inline constexpr int kMasterFrameCount = 5;
std::string_view name(MasterFrame frame);  ///< "SYNC", "NMT command" ...

/** How long to listen before the first frame of one's own, and how long a master that was received is taken to be
 * there, s: three times the drives' time-out for their master, between 0.5 and 2 s.
 *
 * A master that keeps drives in motion sends SYNC in each cycle, and a heartbeat within the drives' time-out; one that
 * is silent for longer has lost its drives to their own watchdogs. Three, because frames get lost; 0.5 s, because the
 * other one's budget may be larger than ours; 2 s is twice the slowest heartbeat in use, 1 s. */
double listeningTime(double heartbeat_budget) noexcept;

/** Counts the frames of other masters. Nothing but describe() allocates. Times are ns on the caller's clock. */
class MasterWatch {
 public:
  struct Received {
    std::uint64_t count = 0;
    std::int64_t last = 0;  ///< when
  };

  /// @param silence after which a master that was received is taken to be gone, ns.
  explicit MasterWatch(std::int64_t silence) noexcept : silence_(silence) {}

  /// @return the first of its kind, or the first after a silence: something to tell people.
  bool note(MasterFrame frame, std::int64_t now) noexcept;
  /// Somebody else commands the bus: SYNC, NMT, our heartbeat or a command PDO within the silence. SDO requests do not
  /// count.
  bool commands(std::int64_t now) const noexcept;
  /// Anything was received at all, SDO requests included.
  bool receivedAny() const noexcept;
  const Received& received(MasterFrame frame) const noexcept { return received_[static_cast<std::size_t>(frame)]; }
  /// "SYNC (125 times), command PDO (750 times)"; empty where nothing was received.
  std::string describe() const;

 private:
  bool recent(MasterFrame frame, std::int64_t now) const noexcept;

  std::int64_t silence_;
  std::array<Received, kMasterFrameCount> received_{};
};

}  // namespace tandem::hal::canopen
