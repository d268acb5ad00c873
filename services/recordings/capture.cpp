// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/capture.h"

#include <algorithm>

#include "services/recordings/run_file.h"

namespace tandem::recordings {
namespace {

constexpr int kDepth = 1000;  // samples in a queue: one second of the fastest topics

}  // namespace

Capture::Capture(dds::Bus& bus,
                 const std::vector<dds::TopicInfo>& topics,
                 const std::function<void(const recording::SampleTag&, std::string_view bytes)>& taken) {
  for (std::size_t i = 0; i < topics.size(); ++i) {
    readers_.push_back(dds::rawReader(bus, topics[i],
                                      [i, taken](const dds::RawSample& sample) {
                                        recording::SampleTag tag;
                                        tag.topic = static_cast<std::uint32_t>(i);
                                        tag.sequence = sample.sequence;
                                        tag.log_time = wallClock();
                                        tag.publish_time =
                                            static_cast<std::uint64_t>(std::max<std::int64_t>(0, sample.source_time));
                                        tag.writer = sample.writer;
                                        taken(tag, sample.bytes);
                                      },
                                      {.depth = kDepth}));
  }
}

int Capture::matched() const {
  return static_cast<int>(
      std::count_if(readers_.begin(), readers_.end(), [](const dds::Reader& reader) { return reader.matched() > 0; }));
}

std::uint64_t Capture::received() const {
  std::uint64_t sum = 0;
  for (const dds::Reader& reader : readers_)
    sum += reader.received();
  return sum;
}

std::uint64_t Capture::lost() const {
  std::uint64_t sum = 0;
  for (const dds::Reader& reader : readers_)
    sum += reader.statistics().lost;
  return sum;
}

std::string Capture::lastProblem() const {
  std::string problem;
  for (const dds::Reader& reader : readers_) {
    if (problem.empty())
      problem = reader.lastProblem();
  }
  return problem;
}

}  // namespace tandem::recordings
