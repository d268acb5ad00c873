// SPDX-License-Identifier: Apache-2.0
#include "services/recorder/fault_trigger.h"

#include <algorithm>

#include "operation/convert.h"
#include "safety/operating_state.h"
#include "services/dds/raw.h"
#include "services/runtime/fault_log.h"

namespace tandem::recorder {

template <class M>
std::optional<std::string> FaultTrigger::eventIn(const M& message, Side& side, const char* who) {
  std::string description;
  const std::size_t arms = std::min<std::size_t>(message.arm_count, robot_.arms.size());
  for (std::size_t k = 0; k < arms; ++k) {
    const bool in_fault = message.operating_state[k] == static_cast<std::uint8_t>(safety::OperatingState::kFault);
    const safety::FaultMask fresh = message.faults[k] & ~side.faults[k];
    // Faults in the first sample are older than the recording.
    if (side.received && ((in_fault && !side.in_fault[k]) || fresh != 0))
      description += (description.empty() ? "" : "; ") + robot_.arms[k].name + ": " + who +
                     " in FAULT: " + safety::describeFaults(message.faults[k]);
    side.in_fault[k] = in_fault;
    side.faults[k] = message.faults[k];
  }
  side.received = true;
  return description.empty() ? std::nullopt : std::optional(description);
}

std::optional<std::string> FaultTrigger::eventOf(const std::string& topic, std::string_view bytes) {
  const std::lock_guard lock(mutex_);
  if (topic == dds::kActuationState.name) {
    if (const auto state = dds::decode<dds::ActuationState>(bytes))
      return eventIn(*state, drives_, "drives");
  } else if (topic == dds::kControlStatus.name) {
    if (const auto status = dds::decode<dds::ControlStatus>(bytes))
      return eventIn(*status, control_, "control");
  } else if (topic == dds::kHalStatus.name) {
    if (const auto status = dds::decode<dds::HalStatus>(bytes))
      status_ = *status;
  } else if (topic == dds::kStop.name) {
    if (const auto stop = dds::decode<dds::Stop>(bytes))
      return "stop: " + stop->reason;
  }
  return std::nullopt;
}

std::string FaultTrigger::details() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (int k = 0; k < static_cast<int>(std::min<std::size_t>(status_.arm_count, robot_.arms.size())); ++k) {
    const safety::FaultRecord record = dds::faultRecordOf(status_, k);
    if (record.faults != 0)
      text += (text.empty() ? "" : "; ") + runtime::describe(robot_, {k, record});
  }
  return text;
}

}  // namespace tandem::recorder
