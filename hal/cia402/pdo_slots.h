// SPDX-License-Identifier: Apache-2.0
/** @file Places of an axis' values in the PDOs of its drive and its encoder. */
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/canopen/node.h"

namespace tandem::hal {

/** Places of the values of a drive. */
struct DriveSlots {
  /// @param sampled_inputs  a sample is complete with the digital inputs only
  DriveSlots(const canopen::Node& drive, bool sampled_inputs) noexcept;

  canopen::PdoSlot statusword() const noexcept { return measured[0]; }
  canopen::PdoSlot position() const noexcept { return measured[1]; }
  canopen::PdoSlot torque() const noexcept { return measured[2]; }  ///< or current; may be in no PDO

  /// What a complete sample has: statusword, position, torque, and the inputs, if they belong to it.
  std::array<canopen::PdoSlot, 4> measured;
  canopen::PdoSlot inputs;  ///< digital ones; may be in no PDO
  canopen::PdoSlot controlword, target;
};

/** Places of the values of an absolute encoder. */
struct EncoderSlots {
  EncoderSlots() = default;
  explicit EncoderSlots(const canopen::Node& encoder) noexcept;
  /// An encoder that the drive reads. @param input  EncoderConfig::drive_input
  EncoderSlots(const canopen::Node& drive, int input) noexcept;

  canopen::PdoSlot position() const noexcept { return measured[0]; }
  canopen::PdoSlot alarms() const noexcept { return measured[1]; }  ///< may be in no PDO

  std::array<canopen::PdoSlot, 2> measured;
};

/** Counts samples of values that one node sends together, in one TPDO or in several: a sample is complete when each of
 * its TPDOs was received since the last complete one. */
class CompleteSamples {
 public:
  /// Once per period. @param values  those that are not mapped do not count. @return whether a sample is complete
  bool take(const canopen::Node& node, std::span<const canopen::PdoSlot> values) noexcept;
  std::uint64_t count() const noexcept { return count_; }  ///< complete samples since the start

 private:
  static constexpr std::size_t kMostPdos = 4;      ///< of a node
  std::array<std::uint64_t, kMostPdos> counts_{};  ///< Tpdo::count at the last complete sample
  std::uint64_t count_ = 0;
};

}  // namespace tandem::hal
