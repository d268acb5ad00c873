// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/pdo_slots.h"

#include <algorithm>

#include "hal/cia402/detail/node_setups.h"

namespace tandem::hal {
namespace {

using canopen::PdoSlot;

PdoSlot either(PdoSlot first, PdoSlot second) noexcept { return first.mapped() ? first : second; }

}  // namespace

DriveSlots::DriveSlots(const canopen::Node& drive, bool sampled_inputs) noexcept
    : measured{drive.tpdoSlot(objects::kStatusword), drive.tpdoSlot(objects::kPosition),
               either(drive.tpdoSlot(objects::kTorque), drive.tpdoSlot(objects::kCurrent)),
               sampled_inputs ? drive.tpdoSlot(objects::kInputs) : PdoSlot{}},
      inputs(drive.tpdoSlot(objects::kInputs)),
      controlword(drive.rpdoSlot(objects::kControlword)),
      target(either(drive.rpdoSlot(objects::kTargetPosition), drive.rpdoSlot(objects::kTargetVelocity))) {}

EncoderSlots::EncoderSlots(const canopen::Node& encoder) noexcept
    : measured{encoder.tpdoSlot(objects::kEncoderPosition), encoder.tpdoSlot(objects::kEncoderAlarms)} {}

EncoderSlots::EncoderSlots(const canopen::Node& drive, int input) noexcept
    : measured{drive.tpdoSlot({objects::kAdditionalPosition, static_cast<std::uint8_t>(input)})} {}

bool CompleteSamples::take(const canopen::Node& node, std::span<const canopen::PdoSlot> values) noexcept {
  bool all = true;
  for (const PdoSlot& value : values) {
    const auto pdo = static_cast<std::size_t>(value.pdo);
    all = all && (!value.mapped() || node.tpdos()[pdo].count != counts_[pdo]);
  }
  if (!all)
    return false;
  for (const PdoSlot& value : values) {
    if (value.mapped())
      counts_[static_cast<std::size_t>(value.pdo)] = node.tpdos()[static_cast<std::size_t>(value.pdo)].count;
  }
  ++count_;
  return true;
}

}  // namespace tandem::hal
