// SPDX-License-Identifier: Apache-2.0
/** @file CANopen slave (CiA 301): NMT, SDO, PDOs, SYNC, heartbeats, emergencies. Derived classes add the device
 * profile. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/canopen/cob.h"
#include "hal/canopen/emcy.h"
#include "sim/drives/life_guard.h"
#include "sim/drives/object_dictionary.h"
#include "sim/drives/pdo_engine.h"
#include "sim/drives/sdo_server.h"

namespace tandem::sim::drives {

using hal::canopen::NmtState;

/** Bits of the error register, object 1001. */
enum class ErrorBit : std::uint8_t {
  kGeneric = 0x01,
  kCurrent = 0x02,
  kVoltage = 0x04,
  kTemperature = 0x08,
  kCommunication = 0x10,
  kProfile = 0x20,
};

/** Counters of a device since construction. */
struct DeviceCounters {
  std::uint64_t frames_in = 0;  ///< addressed to this device
  std::uint64_t frames_out = 0;
  std::uint64_t rpdos = 0;
  std::uint64_t bad_rpdos = 0;  ///< wrong length
  std::uint64_t syncs = 0;
  std::uint64_t sdo_requests = 0;
  std::uint64_t emergencies = 0;
  std::uint64_t heartbeats_lost = 0;
  std::uint64_t rpdo_timeouts = 0;
  std::uint64_t boots = 0;
};

/** Behaviour that CiA 301 and 402 permit, and that not every master expects. */
struct Habits {
  AnswerForm answers = AnswerForm::kSized;
  std::int64_t answer_delay = 0;   ///< of each SDO answer, ns
  bool late_mode_display = false;  ///< of a drive: 6061 follows 6060 only in operation enabled
  std::int64_t rounding = 1;       ///< of a drive: speeds and accelerations that are written become multiples of this
};

/** Simulated device. Time is that of the caller, ns. Frames to send accumulate in out(). */
class Device : private SdoAccess {
 public:
  /// @param own  built-in data sheet (ObjectDictionary). @throw std::invalid_argument for an id out of range or a data
  /// sheet in which an object that the simulation needs is no number.
  Device(std::uint8_t id, const Eds& eds, const Eds& own, std::uint32_t serial);
  ~Device() override = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Power on: boots after kBootTime. Power off: silent, loses its state.
  void powerOn(std::int64_t now) noexcept;
  void powerOff() noexcept;
  bool powered() const noexcept { return powered_; }

  void receive(const CanFrame& frame, std::int64_t now) noexcept;
  /// Advances to `now`: timers, heartbeats, and step() of the derived class.
  void advance(std::int64_t now, double dt) noexcept;
  /// Frames to send; the caller empties it.
  std::vector<CanFrame>& out() noexcept { return out_; }

  std::uint8_t id() const noexcept { return id_; }
  NmtState nmt() const noexcept { return nmt_; }
  ObjectDictionary& dictionary() noexcept { return dictionary_; }
  const ObjectDictionary& dictionary() const noexcept { return dictionary_; }
  const DeviceCounters& counters() const noexcept { return counters_; }
  void setHabits(const Habits& habits) noexcept;
  const Habits& habits() const noexcept { return habits_; }
  /// Time since the last command PDO, s.
  double commandSilence() const noexcept { return pdos_.silence(now_); }
  std::uint16_t lastError() const noexcept { return last_error_; }

  static constexpr std::int64_t kBootTime = 20'000'000;

 protected:
  /// Sends an emergency and stores it in 1001 and 1003.
  void raise(std::uint16_t code, ErrorBit bit, std::uint8_t detail = 0) noexcept;
  /// Clears the errors of these bits; sends an emergency when no error is left.
  void clear(ErrorBit bit) noexcept;
  std::int64_t now() const noexcept { return now_; }
  /// To be called after a change of PDO parameters other than by SDO.
  void reconfigurePdos() noexcept { pdos_.configure(); }

  /// Interface to the derived class. Physics and timers:
  virtual void step(double dt) noexcept = 0;
  /// Called before objects are read: write measured values into them.
  virtual void refresh() noexcept = 0;
  /// The value of an object was written, by SDO or PDO.
  virtual void written(const Entry& entry) noexcept = 0;
  /// The value may be written in the present state.
  virtual SdoAbort accept(const Entry& entry, std::int64_t value) const noexcept = 0;
  /// SYNC, after the RPDOs that waited for it were written.
  virtual void synchronized() noexcept {}
  /// Contact with the master is lost: heartbeat, RPDO deadline, or NMT took the device out of operational.
  virtual void contactLost() noexcept {}
  /// Power off, or reset of the application.
  virtual void resetApplication() noexcept {}

 private:
  struct Producer {  // monitored heartbeat producer: 1016
    std::uint8_t node = 0;
    std::int64_t timeout = 0;
    std::int64_t last = 0;
    bool active = false;
  };

  SdoAbort readObject(ObjectAddress object, std::span<std::uint8_t> bytes, std::size_t& size) override;
  SdoAbort writeObject(ObjectAddress object, std::span<const std::uint8_t> bytes) override;
  void onNmt(const CanFrame& frame) noexcept;
  void onSync(const CanFrame& frame) noexcept;
  void onHeartbeat(const CanFrame& frame) noexcept;
  void onGuard() noexcept;
  /// ns; 0: the master is not watched by node guarding.
  std::int64_t lifeTime() const noexcept;
  void onRpdo(const CanFrame& frame) noexcept;
  void watchMaster() noexcept;
  void communicationError(std::uint16_t code) noexcept;
  void enter(NmtState state) noexcept;
  void boot(bool application) noexcept;
  void loadProducers() noexcept;
  void notifyWritten() noexcept;
  void send(const CanFrame& frame) noexcept;
  void reply(const CanFrame& answer) noexcept;

  std::uint8_t id_;
  ObjectDictionary dictionary_;
  SdoServer sdo_;
  PdoEngine pdos_;
  Entry& error_register_;
  Entry& heartbeat_;
  Entry& sync_id_;
  Entry& emcy_id_;
  Entry& error_behaviour_;
  std::vector<CanFrame> out_;
  std::vector<Entry*> written_;
  std::array<Producer, 2> producers_{};
  LifeGuard life_guard_;
  DeviceCounters counters_;
  NmtState nmt_ = NmtState::kBootUp;
  bool powered_ = false;
  std::int64_t now_ = 0;
  std::int64_t boot_at_ = 0;
  std::int64_t next_heartbeat_ = 0;
  std::uint16_t last_error_ = 0;
  Habits habits_;
  CanFrame held_answer_;        ///< of the SDO server
  std::int64_t answer_at_ = 0;  ///< time to send it, 0: there is none
};

}  // namespace tandem::sim::drives
