// SPDX-License-Identifier: Apache-2.0
/** @file Capture of selected topics as bytes. */
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "recording/sample_ring.h"
#include "services/dds/raw.h"

namespace tandem::recordings {

/** Reads topics until it is destroyed. */
class Capture {
 public:
  /// @param taken  called with each sample on a DDS thread, for one sample of a topic at a time
  Capture(dds::Bus& bus,
          const std::vector<dds::TopicInfo>& topics,
          const std::function<void(const recording::SampleTag&, std::string_view bytes)>& taken);

  /// Topics that have a writer now.
  int matched() const;
  /// Samples received, and samples that DDS reports as lost.
  std::uint64_t received() const;
  std::uint64_t lost() const;
  /// Description of the last error; empty: none.
  std::string lastProblem() const;

 private:
  std::vector<dds::Reader> readers_;
};

}  // namespace tandem::recordings
