// SPDX-License-Identifier: Apache-2.0
/** @file Core of tandem-hal: passes actuation/command to the hardware, and its state to actuation/state; no DDS, no
 * threads. */
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "hal/robot_hardware.h"
#include "safety/watchdog.h"
#include "services/runtime/drive_core.h"

namespace tandem::hal_service {

/** Request of a client as a plain struct for the periodic thread. */
struct ParsedHalRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;
  std::uint8_t arm = dds::kAllArms;
  std::uint8_t joint = 0;  ///< measured: of the arm
  double position = 0.0;   ///< measured: m or rad
};

/** A request and the reply to it, as a plain struct. */
struct HalAnswer : ParsedHalRequest {
  dds::ReplyCode code = dds::ReplyCode::kOk;
  std::uint32_t value = 0;                ///< home: 1 done, 0 running
  dds::PerArm<std::uint8_t> not_homed{};  ///< joints of the requested arms before the request, one bit each
  std::array<char, 120> reason{};
};
/// Converts a reply to its DDS message.
dds::Reply replyOf(const HalAnswer& answer);

/** Passes commands to the hardware and its state to DDS messages. No function after construction allocates, locks or
 * throws. Times are ns, monotonic. */
class HalCore : public runtime::DriveCore<hal::RobotHardware> {
 public:
  /// @param buses open, in the order of the hardware file.
  HalCore(const runtime::Setup& setup,
          const hal::HardwareConfig& hardware,
          std::vector<std::unique_ptr<hal::Fieldbus>> buses);

  /// Before start(): detects other masters on the buses, and sends nothing; see RobotHardware::listen().
  void listen(std::int64_t now) noexcept { drives_.listen(now); }
  void start(std::int64_t now) noexcept { drives_.start(now); }
  /// @param arrivals  commands received so far, this one included; 0: not counted
  void onCommand(const dds::ActuationCommand& command, std::int64_t now, std::uint64_t arrivals = 0) noexcept;
  void onEmergencyStop(bool pressed, std::int64_t now) noexcept { drives_.onEmergencyStop(pressed, now); }
  /// Homing runs and measured positions: only for the lease owner and for arms that control permits to home, both as in
  /// the last command.
  HalAnswer onRequest(const ParsedHalRequest& request, std::int64_t now) noexcept;
  /// One period of the bus.
  void step(std::int64_t now) noexcept { drives_.step(now); }

  /// The state to publish now, with a new sequence.
  void state(std::int64_t now, dds::ActuationState& state) noexcept;
  void status(dds::HalStatus& status) const noexcept;
  /// Before start(): RobotHardware::restorePosition().
  void restorePosition(std::size_t axis, hal::LastPosition state, double position) noexcept {
    drives_.restorePosition(axis, state, position);
  }
  bool nextEvent(hal::HardwareEvent& event) noexcept { return drives_.nextEvent(event); }
  /// Whether an operator has requested a restart of this bus after bus-off; true once per request.
  bool takeRestart(int bus) noexcept { return drives_.takeRestart(bus); }
  const hal::RobotHardware& robot() const noexcept { return drives_; }

 private:
  idl::RefusalReason againstHoming(const ParsedHalRequest& request, int arm, std::int64_t now) const noexcept;
  void home(int arm, std::int64_t now, HalAnswer& answer) noexcept;
  void takeMeasurement(int arm, HalAnswer& answer) noexcept;

  std::uint64_t commander_ = 0;  ///< of the last accepted command
  dds::PerArm<std::uint8_t> may_home_{};
  safety::Watchdog commands_;
};

}  // namespace tandem::hal_service
