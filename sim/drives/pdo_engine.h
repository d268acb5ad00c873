// SPDX-License-Identifier: Apache-2.0
/** @file PDOs of a simulated device: parameters and mappings from the dictionary, SYNC, event and inhibit times. */
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hal/can/frame.h"
#include "sim/drives/object_dictionary.h"

namespace tandem::sim::drives {

using hal::can::CanFrame;

/** Result of a frame for the RPDOs. */
enum class RpdoResult : std::uint8_t { kNotMine, kTaken, kTooShort, kTooLong };

class PdoEngine {
 public:
  static constexpr int kMostPdos = 4;     ///< in each direction
  static constexpr int kMostEntries = 8;  ///< of a mapping

  explicit PdoEngine(ObjectDictionary& dictionary);

  /// A PDO parameter or mapping may be written in the present state; kNone also for all other objects.
  SdoAbort accept(ObjectAddress object, std::int64_t value) const noexcept;
  /// Reads all parameters again and restarts the timers. To be called after a write to one of them, a reset, a change
  /// of state.
  void configure() noexcept;
  static bool isParameter(std::uint16_t index) noexcept { return index >= 0x1400 && index < 0x1C00; }

  /** Processes a frame. Objects of an acyclic RPDO are written at once, others at the next SYNC. Written objects are
   * returned in `written`. */
  RpdoResult receive(const CanFrame& frame, std::int64_t now, std::vector<Entry*>& written) noexcept;
  /// SYNC: writes the objects of the synchronous RPDOs.
  void syncReceive(std::vector<Entry*>& written) noexcept;
  /// SYNC: sends the TPDOs that are due. @param counter of the SYNC, 0: it has none.
  void syncTransmit(std::uint8_t counter, std::vector<CanFrame>& out) noexcept;
  /// Sends event-driven TPDOs whose objects changed or whose timer ran out.
  void poll(std::int64_t now, std::vector<CanFrame>& out) noexcept;
  /// Number of RPDO deadlines (event timer) missed since the last call: each counts once until the RPDO is received
  /// again.
  int takeMissedDeadlines(std::int64_t now) noexcept;
  /// Time since the last RPDO that has a deadline, s; 0 before the first one.
  double silence(std::int64_t now) const noexcept;

 private:
  struct Pdo {
    bool receive = false;
    bool valid = false;
    std::uint32_t id = 0;
    std::uint8_t type = 0;
    std::int64_t inhibit = 0;  ///< ns
    std::int64_t event = 0;    ///< ns
    std::uint8_t start = 0;
    std::array<Entry*, kMostEntries> entries{};
    int count = 0;
    int bytes = 0;

    std::int64_t last_time = 0;  ///< received or sent
    bool seen = false;           ///< since configured
    bool missed = false;
    bool pending = false;  ///< waits for SYNC
    std::array<std::uint8_t, 8> data{};
    int syncs = 0;
    bool started = true;  ///< past its SYNC start value

    bool synchronous() const noexcept { return type <= 240; }
  };

  void load(Pdo& pdo, bool receive, int number) noexcept;
  void apply(Pdo& pdo, std::vector<Entry*>& written) noexcept;
  CanFrame assemble(const Pdo& pdo) const noexcept;
  void send(Pdo& pdo, const CanFrame& frame, std::vector<CanFrame>& out) noexcept;
  SdoAbort acceptCommunication(ObjectAddress object, std::int64_t value) const noexcept;
  SdoAbort acceptMapping(ObjectAddress object, std::int64_t value) const noexcept;
  SdoAbort checkEntry(std::uint32_t raw, bool receive) const noexcept;
  std::int64_t value(std::uint16_t index, std::uint8_t sub) const noexcept;

  ObjectDictionary& dictionary_;
  std::array<Pdo, 2 * kMostPdos> pdos_{};
};

}  // namespace tandem::sim::drives
