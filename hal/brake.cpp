// SPDX-License-Identifier: Apache-2.0
#include "hal/brake.h"

#include <cmath>

namespace tandem::hal {

void Brake::restart(std::int64_t now) noexcept {
  open_ = writing_ = holding_ = false;
  obeys_ = true;
  since_ = now;
}

bool Brake::step(bool open, bool torque, double position, AxisDriver& driver, std::int64_t now) noexcept {
  if (writing_) {
    const Progress progress = driver.brake();
    writing_ = progress == Progress::kBusy;
    if (progress == Progress::kFailed) {
      obeys_ = false;
      open_ = true;  // state unknown: assumed open; closing is tried again
    }
    since_ = now;
  }
  if (!writing_ && (open ? !open_ && obeys_ : open_) && driver.setBrake(!open)) {
    open_ = open;
    writing_ = true;
  }
  const bool holds = !torque && closed(now);
  if (holds && !holding_)
    held_ = position;
  holding_ = holds;
  if (holding_ && std::abs(position - held_) > config_.slip)
    obeys_ = false;
  return obeys_;
}

}  // namespace tandem::hal
