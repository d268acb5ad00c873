// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/mode_confirmation.h"

#include "hal/cia402/detail/node_setups.h"
#include "hal/nanoseconds.h"

namespace tandem::hal {

void ModeConfirmation::expect(DriveMode mode, bool confirmed) noexcept {
  jobs_.clear();
  mode_ = mode;
  confirmed_ = confirmed;
}

bool ModeConfirmation::step(bool operation, bool free, canopen::Node& node, std::int64_t now) noexcept {
  if (confirmed_)
    return true;
  if (!operation && !reading())
    return true;
  if (!reading()) {
    if (!free)
      return true;
    jobs_.clear();
    jobs_.await(objects::kModeDisplay, static_cast<int>(mode_), 1, kSecond);
  }
  const SdoJobs::Status status = jobs_.step(node, now);
  confirmed_ = status == SdoJobs::Status::kDone;
  return status != SdoJobs::Status::kFailed;
}

}  // namespace tandem::hal
