// SPDX-License-Identifier: Apache-2.0
/** @file All simulated drives and encoders of one CAN bus. */
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "hal/can/bus.h"
#include "sim/drives/drive.h"
#include "sim/drives/encoder.h"
#include "sim/drives/faults.h"

namespace tandem::sim::drives {

struct BusSpec {
  std::vector<DriveSpec> drives;
  std::vector<EncoderSpec> encoders;
  Eds drive_eds = driveEds();
  std::map<std::uint8_t, Eds> drive_eds_of{};  ///< by node: drives with another data sheet
  Eds encoder_eds = encoderEds();
  std::uint32_t seed = 1;  ///< of frame losses and bit flips
};

/** Counters of the frames on the simulated side of the bus. */
struct BusRecord {
  std::uint64_t received = 0;
  std::uint64_t sent = 0;
  std::uint64_t unsent = 0;   ///< refused by the bus; tried again
  std::uint64_t dropped = 0;  ///< the queue to the bus was full
  std::uint64_t lost = 0;     ///< by injected faults, in either direction
  std::uint64_t flipped = 0;
  std::uint64_t babble_frames = 0;
};

/** Call poll() at each received frame, and every millisecond. Times are ns on the clock of the bus. */
class DriveBus {
 public:
  /// All nodes are switched on. The bus must outlive this. @throw std::invalid_argument: an id used twice, an encoder
  /// without drive, a data sheet with a text where the drive needs a number.
  DriveBus(hal::can::Bus& bus, const BusSpec& spec, std::int64_t now);
  ~DriveBus();

  /// Advances physics and timers to `now`, processes received frames at their arrival times, then sends.
  void poll(std::int64_t now) noexcept;

  /// False: the bus has no such node, or a node of that kind cannot have this fault.
  bool inject(const Injection& injection) noexcept;
  /// Ends faults of a node (0: of all nodes and of the bus). @return number of ended faults.
  int clear(std::uint8_t node, std::optional<FaultKind> kind) noexcept;
  bool has(std::uint8_t node, FaultKind kind) const noexcept;
  /// Starts new records of all drives.
  void mark() noexcept;

  std::vector<std::unique_ptr<Drive>>& drives() noexcept { return drives_; }
  std::vector<std::unique_ptr<Encoder>>& encoders() noexcept { return encoders_; }
  const BusRecord& record() const noexcept { return record_; }
  hal::can::Bus& bus() noexcept { return bus_; }

  static constexpr std::int64_t kStep = 250'000;  ///< of the physics, ns

 private:
  struct Active {
    Injection injection;
    std::int64_t begin = 0;
    std::int64_t end = 0;  ///< 0: none
  };
  struct Delayed {
    CanFrame frame;
    std::int64_t due = 0;
  };
  struct Node;

  Node* nodeOf(std::uint8_t id) noexcept;
  bool possible(const Injection& injection) noexcept;
  void apply(const Injection& injection, bool on) noexcept;
  void applyTo(Node& node, const Injection& injection, bool on) noexcept;
  void advance(std::int64_t now) noexcept;
  void expire(std::int64_t now) noexcept;
  void applyIntermittentFault(std::int64_t now) noexcept;
  void receive(std::int64_t now) noexcept;
  void collect(Node& node, std::int64_t now) noexcept;
  void release(std::int64_t now) noexcept;
  void babble(std::int64_t now) noexcept;
  void flush() noexcept;
  bool loses(const Node& node) noexcept;
  void sendError(std::uint32_t error_class) noexcept;

  hal::can::Bus& bus_;
  std::vector<std::unique_ptr<Drive>> drives_;
  std::vector<std::unique_ptr<Encoder>> encoders_;
  std::vector<Node> nodes_;
  std::vector<Active> active_;
  std::vector<Delayed> delayed_;
  std::vector<CanFrame> outgoing_;
  std::array<CanFrame, 64> incoming_{};
  std::mt19937 random_;
  BusRecord record_;
  std::int64_t time_;
  bool off_ = false;
};

}  // namespace tandem::sim::drives
