// SPDX-License-Identifier: Apache-2.0
/** @file Simulated absolute encoder (CiA 406). */
#pragma once

#include <cstdint>
#include <random>

#include "sim/drives/device.h"
#include "sim/drives/drive.h"
#include "sim/drives/load_position.h"

namespace tandem::sim::drives {

/** One encoder of a bus, on the axis of a drive. */
struct EncoderSpec : LoadSpec {
  std::uint8_t id = 11;
  std::uint32_t serial = 1;
  std::uint8_t drive = 1;  ///< node id of the drive whose axis it measures
};

class Encoder final : public Device {
 public:
  /// The drive must outlive the encoder. @throw std::invalid_argument if the data sheet lacks an object.
  Encoder(const EncoderSpec& spec, const Eds& eds, const Motor& motor);

  SensorFaults sensor;
  const EncoderSpec& spec() const noexcept { return spec_; }
  /// Undisturbed reading, units.
  double position() const noexcept;

 private:
  void step(double dt) noexcept override;
  void refresh() noexcept override;
  void written(const Entry& entry) noexcept override;
  SdoAbort accept(const Entry& entry, std::int64_t value) const noexcept override;

  EncoderSpec spec_;
  const Motor& motor_;
  LoadPosition load_;
  std::mt19937 random_;
  Entry &operating_, &status_, &preset_, &position_value_, &speed_, &timer_, &alarms_, &offset_, &operating_time_;
  std::int64_t preset_offset_ = 0;  ///< survives power off, as in a real encoder
  std::int32_t held_reading_ = 0;
  bool alarmed_ = false;
  double hours_ = 0.0;
};

}  // namespace tandem::sim::drives
