// SPDX-License-Identifier: Apache-2.0
#include "hal/emergency_stop.h"

namespace tandem::hal {

using safety::EmergencyStop;

void EmergencyStopWatch::add(const EmergencyInput& input, const AxisDriver& driver) {
  sources_.push_back({input, &driver});
}

void EmergencyStopWatch::listen(Source& source, std::int64_t now) const noexcept {
  const DriveInputs inputs = source.driver->inputs(source.input.statusword);
  if (!inputs.up) {
    source.stream.restart();
    source.lost = source.lost || inputs.failed;
    return;
  }
  source.stream.watch(inputs.arrivals, now);
  if (source.stream.fresh()) {
    const bool high = (inputs.bits >> source.input.bit & 1u) != 0;
    source.pressed = high != source.input.active_low;
    source.read = true;
    source.lost = false;
  } else if (source.stream.silent(budget_, now)) {
    source.lost = true;
  }
}

int EmergencyStopWatch::update(std::int64_t now) noexcept {
  int began = -1;
  bool pressed = false, readable = false, lost = false;
  for (Source& source : sources_) {
    const bool was_pressed = source.pressed;
    listen(source, now);
    if (source.pressed && !was_pressed && began < 0)
      began = source.input.axis;
    readable = readable || (source.read && !source.lost);
    lost = lost || source.lost;
  }
  // A lost input keeps its last value as long as no other input is received.
  for (const Source& source : sources_)
    pressed = pressed || (source.pressed && !(source.lost && readable));
  silent_ = reports_.silent(now);
  lost_ = lost && !readable;
  const bool all = (sources_.empty() || readable) && (!reports_.asked() || (reports_.received() && !silent_));
  const bool any = !sources_.empty() || reports_.asked();
  pressed = pressed || reports_.pressed();
  state_ = pressed ? EmergencyStop::kPressed : all && any ? EmergencyStop::kReleased : EmergencyStop::kNotRead;
  return began;
}

}  // namespace tandem::hal
