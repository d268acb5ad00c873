// SPDX-License-Identifier: Apache-2.0
#include "hal/brake.h"

#include <cmath>

#include "hal/detail/node_setups.h"

namespace tandem::hal {

void Brake::restart(std::int64_t now) noexcept {
  jobs_.clear();
  open_ = writing_ = holding_ = false;
  obeys_ = true;
  since_ = now;
}

bool Brake::step(bool open, bool torque, double position, bool free, canopen::Node& node, std::int64_t now) noexcept {
  if (writing_) {
    const SdoJobs::Status status = jobs_.step(node, now);
    writing_ = status == SdoJobs::Status::kBusy;
    if (status == SdoJobs::Status::kFailed) {
      obeys_ = false;
      open_ = true;  // state unknown: assumed open; closing is tried again
    }
    since_ = now;
  }
  if (!writing_ && free && (open ? !open_ && obeys_ : open_)) {
    open_ = open;
    writing_ = true;
    jobs_.clear();
    jobs_.write(objects::kOutputs, config_.output(!open), 4);
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
