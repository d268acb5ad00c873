// SPDX-License-Identifier: Apache-2.0
#include "services/console/decimation.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "services/dds/raw.h"

namespace tandem::console {
namespace {

constexpr double kVisibleShare = 1.1;  // a peak that is lower than this times its neighbours is not visible

/** FNV-1a over the values of members. */
class EventHash {
 public:
  template <class T>
  EventHash& operator<<(const T& value) {
    if constexpr (std::is_integral_v<T>) {
      hash_ = (hash_ ^ static_cast<std::uint64_t>(value)) * 0x100000001b3;
    } else {
      for (const auto& element : value)
        *this << element;
    }
    return *this;
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325;
};

SampleFeatures featuresOf(const dds::ControlStatus& s) {
  constexpr double kLength = 1e-6, kScale = 0.01, kTime = 5e-5;  // m, 1, s
  SampleFeatures features;
  features.events = (EventHash() << s.session << s.operating_state << s.homed << s.recovery << s.faults << s.lease_owner
                                 << s.paused_by << s.method << s.backend << s.bounds << s.model << s.feedback)
                        .value();
  features.peaks = {{{s.task_error[0], kLength},
                     {s.task_error[1], kLength},
                     {1.0 - s.task_scale[0], kScale},
                     {1.0 - s.task_scale[1], kScale},
                     {s.solve_time, kTime},
                     {s.cycle_time, kTime}}};
  return features;
}

SampleFeatures featuresOf(const dds::HalStatus& s) {
  SampleFeatures features;
  features.events = (EventHash() << s.session << s.operating_state << s.faults << s.first_fault << s.emergency_stop
                                 << s.homed << s.power)
                        .value();
  return features;
}

SampleFeatures featuresOf(const dds::PlanningReference& s) {
  SampleFeatures features;
  features.events = (EventHash() << s.trajectory_id << s.phase).value();
  return features;
}

template <class M>
SampleFeatures decoded(std::string_view bytes) {
  const auto message = dds::decode<M>(bytes);
  return message ? featuresOf(*message) : SampleFeatures{};
}

}  // namespace

SampleFeatures featuresOf(std::string_view type, std::string_view bytes) {
  if (type == dds::ControlStatus::kType)
    return decoded<dds::ControlStatus>(bytes);
  if (type == dds::HalStatus::kType)
    return decoded<dds::HalStatus>(bytes);
  if (type == dds::PlanningReference::kType)
    return decoded<dds::PlanningReference>(bytes);
  return {};
}

bool Decimation::due(std::uint64_t now) const {
  // A clock that was set back blocks no samples.
  return now >= due_ || due_ - now > interval_;
}

void Decimation::hold(const Held& held) {
  for (std::size_t k = 0; k < highest_.size(); ++k) {
    if (!highest_[k].sample.bytes || held.features.peaks[k].value > highest_[k].features.peaks[k].value)
      highest_[k] = held;
  }
  newest_ = held;
}

std::vector<HubSample> Decimation::select(const Held& newest, std::uint64_t now) {
  std::vector<HubSample> selected;
  for (std::size_t k = 0; k < highest_.size(); ++k) {
    const Held& high = highest_[k];
    if (!high.sample.bytes || !sent_ || high.sample.bytes == newest.sample.bytes)
      continue;
    const double beside = std::max(sent_->peaks[k].value, newest.features.peaks[k].value);
    if (high.features.peaks[k].value > kVisibleShare * beside + high.features.peaks[k].resolution)
      selected.push_back(high.sample);
  }
  std::sort(selected.begin(), selected.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  selected.erase(
      std::unique(selected.begin(), selected.end(), [](const auto& a, const auto& b) { return a.bytes == b.bytes; }),
      selected.end());
  selected.push_back(newest.sample);
  sent_ = newest.features;
  newest_.reset();
  highest_ = {};
  if (due(now)) {
    const bool keeps_pace = now >= due_ && now - due_ < interval_;
    due_ = (keeps_pace ? due_ : now) + interval_;
  }
  return selected;
}

std::vector<HubSample> Decimation::take(const HubSample& sample, const SampleFeatures& features) {
  if (!limited())
    return {sample};
  const bool event = sent_ && features.events != (newest_ ? newest_->features.events : sent_->events);
  if (event || due(sample.time))
    return select({sample, features}, sample.time);
  hold({sample, features});
  return {};
}

std::vector<HubSample> Decimation::look(std::uint64_t now) {
  if (!newest_ || !due(now))
    return {};
  return select(Held(*newest_), now);
}

}  // namespace tandem::console
