// SPDX-License-Identifier: Apache-2.0
/** @file The hardware behind the topics of hal; no DDS, no threads. */
#pragma once

#include <array>

#include "hal/robot_hardware.h"
#include "services/setup/process.h"

namespace tandem::service {

/** A request of a client as a plain struct that the periodic thread can take. */
struct HalOrder {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;
  std::uint8_t arm = dds::kAllArms;
};

/** Its answer. */
struct HalAnswer {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  dds::ReplyCode code = dds::ReplyCode::kOk;
  std::uint32_t value = 0;  ///< home: 1 done, 0 running
  std::array<char, 120> reason{};
};
/// As it goes over the wire.
dds::Reply replyOf(const HalAnswer& answer);

/** Wire in, hardware, wire out. Nothing after construction allocates, locks or throws. Times are ns, monotonic. */
class HalCore {
 public:
  /// @param buses open, in the order of the hardware file; they outlive the core.
  HalCore(const Setup& setup, const hal::HardwareConfig& hardware, const std::vector<hal::can::Bus*>& buses);

  /// Before start(): hears who else is on the buses, and sends nothing; see RobotHardware::listen().
  void listen(std::int64_t now) noexcept { robot_.listen(now); }
  void start(std::int64_t now) noexcept { robot_.start(now); }
  void onCommand(const dds::ActuationCommand& command, std::int64_t now) noexcept;
  void onStop() noexcept { robot_.stop(); }
  void onEmergencyStop(bool pressed, std::int64_t now) noexcept { robot_.onEmergencyStop(pressed, now); }
  HalAnswer onOrder(const HalOrder& order, std::int64_t now) noexcept;
  /// One period of the bus.
  void step(std::int64_t now) noexcept { robot_.step(now); }

  /// The state to publish now, with a new sequence.
  void state(std::int64_t now, dds::ActuationState& state) noexcept;
  void status(std::int64_t now, dds::HalStatus& status) const noexcept;
  bool nextEvent(hal::HardwareEvent& event) noexcept { return robot_.nextEvent(event); }
  /// An operator wishes this bus to be restarted after bus-off; true once per wish.
  bool takeRestart(int bus) noexcept { return robot_.takeRestart(bus); }
  int armCount() const noexcept { return robot_.armCount(); }
  /// What led an arm into FAULT; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept { return robot_.faultRecord(arm); }
  const hal::RobotHardware& robot() const noexcept { return robot_; }

 private:
  const Setup& setup_;
  hal::RobotHardware robot_;
  safety::StateStamps stamps_;
  safety::ShownFaults shown_faults_;
  std::uint64_t sequence_ = 0;
  safety::RobotCommand command_;
};

}  // namespace tandem::service
