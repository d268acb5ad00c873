// SPDX-License-Identifier: Apache-2.0
/** @file Fieldbus CANopen: the drives and encoders of axes on one CAN bus. */
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/canopen/network.h"
#include "hal/cia402/cia402_driver.h"
#include "hal/fieldbus.h"

namespace tandem::hal {

/** CANopen master of one CAN bus, and the drivers of its axes. Nothing after the last addAxis() allocates, locks or
 * throws, except texts. */
class CanopenBus final : public Fieldbus {
 public:
  /// @param bus open; outlives this. @param index of the bus in the hardware file
  CanopenBus(can::Bus& bus, const HardwareConfig& hardware, int index, const safety::Budgets& budgets);
  /// The bus belongs to this.
  CanopenBus(std::unique_ptr<can::Bus> bus, const HardwareConfig& hardware, int index, const safety::Budgets& budgets)
      : CanopenBus(*bus, hardware, index, budgets) {
    owned_ = std::move(bus);
  }

  Cia402Driver& addAxis(const HardwareConfig& hardware,
                        const AxisConfig& axis,
                        const safety::Budgets& budgets) override;
  /// canopen::listeningTime() of the drives' time-out, s.
  double listeningTime() const noexcept override { return listening_time_; }
  void start(std::int64_t now) noexcept override;
  void receive(std::int64_t now) noexcept override;
  void transmit(std::int64_t now, bool moving) noexcept override;
  bool nextEvent(FieldbusEvent& event) noexcept override;
  BusState state() const noexcept override { return network_.bus().state(); }
  bool faulty() const noexcept override { return network_.bus().faulty(); }
  FieldbusCounters counters() const noexcept override;
  double load() const noexcept override { return load_; }
  bool otherMaster(std::int64_t now) const noexcept override { return network_.masters().commands(now); }
  std::string otherMasters() const override { return network_.masters().describe(); }
  std::string describeMaster(std::uint8_t master) const override;

  const canopen::Network& network() const noexcept { return network_; }

 private:
  void measureLoad(std::int64_t now) noexcept;
  void report(const canopen::NetworkEvent& found, FieldbusEvent& event) noexcept;

  std::unique_ptr<can::Bus> owned_;  ///< nullptr: somebody else's
  canopen::Network network_;
  double listening_time_;
  double bit_rate_;
  std::vector<std::unique_ptr<Cia402Driver>> drivers_;
  std::vector<int> axis_of_node_;  ///< by the network's index of the node
  double load_ = 0.0;  ///< used share of the bit rate, from the frames of the last second with the most stuff bits
  double bits_ = 0.0;  ///< of all frames at the beginning of the window
  std::int64_t window_ = 0;  ///< its beginning, ns
};

/// One for each CAN bus, in order. @param buses open; they outlive the result.
std::vector<std::unique_ptr<Fieldbus>> canopenBuses(const HardwareConfig& hardware,
                                                    const std::vector<can::Bus*>& buses,
                                                    const safety::Budgets& budgets);

}  // namespace tandem::hal
