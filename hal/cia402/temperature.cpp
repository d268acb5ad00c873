// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/temperature.h"

#include <algorithm>

#include "hal/canopen/bytes.h"
#include "hal/nanoseconds.h"

namespace tandem::hal {

void Temperature::step(bool free, canopen::Node& node, std::int64_t now) noexcept {
  if (object_.index == 0)
    return;
  if (!reading()) {
    if (!free || now < next_)
      return;
    next_ = now + kSecond;
    jobs_.clear();
    jobs_.read(object_);
  }
  const SdoJobs::Status status = jobs_.step(node, now);
  if (status == SdoJobs::Status::kDone) {
    const int bits = 8 * static_cast<int>(std::clamp<std::size_t>(node.sdo().data().size(), 1, 4));
    value_ = scale_ * static_cast<double>(canopen::signExtend(jobs_.value(), bits));
  } else if (status == SdoJobs::Status::kFailed) {
    value_ = std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace tandem::hal
