// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/encoder.h"

#include <algorithm>
#include <cmath>

namespace tandem::sim::drives {
namespace {

constexpr std::uint16_t kReverse = 0x01;    // of 6000
constexpr std::int64_t kPositionAlarm = 1;  // of 6503

}  // namespace

Encoder::Encoder(const EncoderSpec& spec, const Eds& eds, const Motor& motor)
    : Device(spec.id, eds, encoderEds(), spec.serial),
      spec_(spec),
      motor_(motor),
      load_(spec, motor.position()),
      random_(spec.id),
      operating_(dictionary().require(0x6000)),
      status_(dictionary().require(0x6500)),
      preset_(dictionary().require(0x6003)),
      position_value_(dictionary().require(0x6004)),
      speed_(dictionary().require(0x6030)),
      timer_(dictionary().require(0x6200)),
      alarms_(dictionary().require(0x6503)),
      offset_(dictionary().require(0x6509)),
      operating_time_(dictionary().require(0x6508)) {
  Entry& number = dictionary().require(0x650B);
  number.info.value = spec.serial;
  number.value = spec.serial;
  dictionary().require(0x1800, 5);
}

double Encoder::position() const noexcept {
  const double sign = (operating_.value & kReverse) != 0 ? -1.0 : 1.0;
  return sign * load_.position() + static_cast<double>(preset_offset_);
}

void Encoder::step(double dt) noexcept {
  load_.follow(motor_.position());
  hours_ += dt / 3600.0;
  if (!powered() || sensor.alarm == alarmed_)
    return;
  alarmed_ = sensor.alarm;
  if (alarmed_) {
    raise(hal::canopen::error_code::kEncoder, ErrorBit::kProfile);
  } else {
    clear(ErrorBit::kProfile);
  }
}

void Encoder::refresh() noexcept {
  position_value_.value = load_.wrapped(sensor.distort(position(), held_reading_, random_));
  speed_.value = std::clamp<std::int64_t>(std::llround(spec_.ratio * motor_.velocity()), -32768, 32767);
  alarms_.value = sensor.alarm ? kPositionAlarm : 0;
  status_.value = operating_.value;
  offset_.value = preset_offset_;
  operating_time_.value = std::llround(10.0 * hours_);
}

void Encoder::written(const Entry& entry) noexcept {
  if (&entry == &preset_) {
    preset_offset_ += preset_.value - std::llround(position());
  } else if (&entry == &timer_) {
    dictionary().require(0x1800, 5).value = timer_.value;
    reconfigurePdos();
  } else if (entry.info.address == ObjectAddress{0x1800, 5}) {
    timer_.value = entry.value;
  }
}

SdoAbort Encoder::accept(const Entry& entry, std::int64_t value) const noexcept {
  // Bit 0 direction, bit 2 scaling; this encoder does not support scaling.
  if (&entry == &operating_ && (value & ~std::int64_t{kReverse}) != 0)
    return SdoAbort::kValueRange;
  return SdoAbort::kNone;
}

}  // namespace tandem::sim::drives
