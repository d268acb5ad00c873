// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/hal_watch.h"

#include <stdexcept>

namespace tandem::service {
namespace {

dds::TopicInfo named(const std::string& name) {
  for (const dds::TopicInfo& topic : dds::allTopics({})) {
    if (topic.name == name)
      return topic;
  }
  throw std::logic_error(name);
}

}  // namespace

bool actedUpon(const dds::TopicInfo& topic) {
  const bool stream = topic.profile == dds::Profile::kPeriodic || topic.profile == dds::Profile::kCommand;
  return stream || topic.publisher == "clients" || topic.publisher == "everyone";
}

HalWatch::HalWatch(dds::Bus& bus)
    : states_(dds::rawReader(bus,
                             named(dds::kActuationState.name),
                             [this](const dds::RawSample& sample) {
                               const std::lock_guard lock(mutex_);
                               state_heard_ = state_heard_ || !sample.own;
                             })),
      statuses_(dds::rawReader(bus, named(dds::kHalStatus.name), [this](const dds::RawSample& sample) {
        heardStatus(sample);
      })) {}

void HalWatch::heardStatus(const dds::RawSample& sample) {
  if (sample.own)
    return;
  const auto status = dds::decode<dds::HalStatus>(sample.bytes);
  const std::lock_guard lock(mutex_);
  status_heard_ = true;
  hardware_ = hardware_ || !status || status->bus_count > 0;
}

HalWatch::Found HalWatch::found() const {
  const std::lock_guard lock(mutex_);
  if (hardware_ || (state_heard_ && !status_heard_))
    return Found::kHardware;
  return status_heard_ ? Found::kSimulator : Found::kNothing;
}

std::string HalWatch::describe() const {
  const std::lock_guard lock(mutex_);
  return hardware_       ? "a HAL with hardware publishes hal/status"
         : status_heard_ ? "a simulator publishes hal/status"
         : state_heard_  ? "somebody publishes actuation/state and does not say what drives it has"
                         : "nobody publishes actuation/state";
}

}  // namespace tandem::service
