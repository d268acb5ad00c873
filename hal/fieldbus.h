// SPDX-License-Identifier: Apache-2.0
/** @file Interface to one bus with the devices of axes: CANopen, another fieldbus, a serial line, or a library. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "hal/axis_driver.h"
#include "hal/hardware.h"
#include "idl/enumerations.h"
#include "safety/budgets.h"

namespace tandem::hal {

using idl::BusState;
using idl::name;

/** Event of a bus or of a device on it, in order of occurrence. */
struct FieldbusEvent {
  enum class Kind : std::uint8_t {
    kFailure,    ///< a device has failed: `failure`
    kEmergency,  ///< a device reports the error `code`; 0: it withdraws all
    kState,      ///< the bus has entered `state`
    kMaster,     ///< another master sends: `master`, for Fieldbus::describeMaster()
  };
  Kind kind = Kind::kState;
  int axis = -1;         ///< number of the axis on this bus, in the order of addAxis(); -1: the bus
  bool encoder = false;  ///< the device is the encoder of that axis
  std::uint16_t code = 0;
  DeviceFailure failure;
  BusState state = BusState::kActive;
  std::uint8_t master = 0;
};

/** Counters of a bus since it was opened. */
struct FieldbusCounters {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  std::uint64_t dropped = 0;   ///< could not be sent
  std::uint64_t overflow = 0;  ///< were lost before they were read
};

/** One bus. RobotHardware calls receive() at the beginning and transmit() at the end of each period, on the periodic
 * thread. What is noexcept must not allocate, lock, wait or throw. Times are ns on the caller's clock. */
class Fieldbus {
 public:
  virtual ~Fieldbus() = default;

  /** Adds the devices of one axis. The driver belongs to the bus.
   * @throw std::invalid_argument: the bus cannot have such an axis, or its devices contradict others. */
  virtual AxisDriver& addAxis(const HardwareConfig& hardware,
                              const AxisConfig& axis,
                              const safety::Budgets& budgets) = 0;

  /// Time for which receive() has to look for other masters before the first transmit(), s; 0: there can be none.
  virtual double listeningTime() const noexcept { return 0.0; }
  /// The devices may notice from now on that the HAL is there, and that it is silent.
  virtual void start([[maybe_unused]] std::int64_t now) noexcept {}
  /// Takes what the devices have sent.
  virtual void receive(std::int64_t now) noexcept = 0;
  /// Sends the commands of all axes, and makes the devices sample. @param moving  a drive moves or holds its joint
  virtual void transmit(std::int64_t now, bool moving) noexcept = 0;
  /// Removes the oldest event. False: there is none.
  virtual bool nextEvent([[maybe_unused]] FieldbusEvent& event) noexcept { return false; }

  virtual BusState state() const noexcept { return BusState::kActive; }
  /// Nothing can be sent: all its axes stop.
  virtual bool faulty() const noexcept { return false; }
  virtual FieldbusCounters counters() const noexcept { return {}; }
  /// Used share of the bus in the last second, 0 to 1.
  virtual double load() const noexcept { return 0.0; }

  /// Another master commands the devices now.
  virtual bool otherMaster([[maybe_unused]] std::int64_t now) const noexcept { return false; }
  /// Description of the frames that other masters have sent since the start; empty: none.
  virtual std::string otherMasters() const { return {}; }
  /// Meaning of FieldbusEvent::master, for the publisher thread: ": SYNC from another master; stop it".
  virtual std::string describeMaster([[maybe_unused]] std::uint8_t master) const { return {}; }
};

/// BusConfig::address of a bus behind a library: kLibraryScheme, path, and perhaps a comma and a text for it.
inline constexpr std::string_view kLibraryScheme = "library:";
/// The bus is behind a library: its traffic is not known.
inline bool inLibrary(const BusConfig& bus) noexcept { return bus.address.starts_with(kLibraryScheme); }

/// Changes with every incompatible change of Fieldbus or AxisDriver.
inline constexpr std::uint32_t kFieldbusVersion = 1;

/** Return value of function tandem_fieldbus of a library in a hardware file (`interface: library:PATH,TEXT`),
 * with C linkage and no arguments. The library is compiled with the headers of the tandem-hal that loads it. */
struct FieldbusLibrary {
  std::uint32_t version = kFieldbusVersion;
  std::uint32_t sizes[3] = {sizeof(HardwareConfig), sizeof(AxisConfig), sizeof(DriveFeedback)};
  /// Opens one bus of the hardware file, by its index; TEXT is in BusConfig::address. The caller owns it.
  /// @throw std::exception with the reason
  Fieldbus* (*open)(const HardwareConfig& hardware, int bus) = nullptr;
};

}  // namespace tandem::hal
