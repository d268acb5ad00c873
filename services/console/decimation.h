// SPDX-License-Identifier: Apache-2.0
/** @file Selection of the samples of one topic that a client with a limited rate receives. No sockets here. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::console {

/** A serialized sample, shared among clients. */
struct HubSample {
  std::shared_ptr<const std::string> bytes;
  std::uint64_t time = 0;  ///< of reception, ns since the epoch
};

/** The parts of a sample that must not be lost between two samples that are sent. */
struct SampleFeatures {
  /** A value of which charts show peaks. */
  struct Peak {
    double value = 0.0;
    double resolution = 0.0;  ///< a smaller difference is not visible
  };
  std::uint64_t events = 0;  ///< hash of the members whose changes are events: states, faults, lease owner, phase
  std::array<Peak, 6> peaks{};
};

/// Features of a sample of a ROS 2 type: those of control/status, hal/status and planning/reference; empty ones for
/// others.
SampleFeatures featuresOf(std::string_view type, std::string_view bytes);

/** Selects, for one subscription: one sample per interval, at the time of its end the newest one; the samples with the
 * peaks between it and the one before; and without delay every sample with an event. */
class Decimation {
 public:
  /// @param interval  ns; 0: every sample is selected
  explicit Decimation(std::uint64_t interval) : interval_(interval) {}

  bool limited() const { return interval_ > 0; }
  /// A new sample. @return samples to send now, the oldest first
  std::vector<HubSample> take(const HubSample& sample, const SampleFeatures& features);
  /// The newest sample, if it waits since the end of its interval: no newer one has come. @param now  ns since the
  /// epoch
  std::vector<HubSample> look(std::uint64_t now);

 private:
  struct Held {
    HubSample sample;
    SampleFeatures features;
  };

  bool due(std::uint64_t now) const;
  void hold(const Held& held);
  std::vector<HubSample> select(const Held& newest, std::uint64_t now);

  std::uint64_t interval_, due_ = 0;
  std::optional<SampleFeatures> sent_;  ///< of the last sample that was sent
  std::optional<Held> newest_;          ///< since then
  std::array<Held, std::tuple_size_v<decltype(SampleFeatures::peaks)>> highest_{};  ///< since then, by peak
};

}  // namespace tandem::console
