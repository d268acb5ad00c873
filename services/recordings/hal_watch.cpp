// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/hal_watch.h"

#include <stdexcept>

namespace tandem::recordings {
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
  return isStream(topic.profile) || topic.publisher == "clients" || topic.publisher == "everyone";
}

HalWatch::HalWatch(dds::Bus& bus)
    : states_(dds::rawReader(bus,
                             named(dds::kActuationState.name),
                             [this](const dds::RawSample& sample) {
                               const std::lock_guard lock(mutex_);
                               state_received_ = state_received_ || !sample.own;
                             })),
      statuses_(dds::rawReader(bus, named(dds::kHalStatus.name), [this](const dds::RawSample& sample) {
        onStatus(sample);
      })) {}

void HalWatch::onStatus(const dds::RawSample& sample) {
  if (sample.own)
    return;
  const auto status = dds::decode<dds::HalStatus>(sample.bytes);
  const std::lock_guard lock(mutex_);
  status_received_ = true;
  hardware_ = hardware_ || !status || status->bus_count > 0;
}

HalWatch::DriveSource HalWatch::driveSource() const {
  const std::lock_guard lock(mutex_);
  if (hardware_ || (state_received_ && !status_received_))
    return DriveSource::kHardware;
  return status_received_ ? DriveSource::kSimulator : DriveSource::kNothing;
}

std::string HalWatch::describe() const {
  const std::lock_guard lock(mutex_);
  return hardware_          ? "a HAL with hardware publishes hal/status"
         : status_received_ ? "a simulator publishes hal/status"
         : state_received_  ? "a process publishes actuation/state, but no hal/status"
                            : "no process publishes actuation/state";
}

}  // namespace tandem::recordings
