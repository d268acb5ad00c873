// SPDX-License-Identifier: Apache-2.0
/** @file Recorder of topics to MCAP files, for `tandem record`.
 *
 * Samples are stored in a ring buffer, so that DDS never waits for the disk; the owner of a Recorder empties it with
 * drain(). Overwritten samples and gaps in the sequences of the writers are counted.
 */
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <utility>

#include "recording/gaps.h"
#include "recording/sample_ring.h"
#include "services/recordings/run_file.h"

namespace tandem::recordings {

struct RecorderOptions {
  std::filesystem::path file;       ///< NAME.mcap; further files are NAME_2.mcap, NAME_3.mcap ...
  std::uint64_t largest_file = 0;   ///< bytes; 0: no limit
  double longest_file = 0.0;        ///< s; 0: no limit
  std::size_t memory = 64'000'000;  ///< bytes between DDS and the disk, at most: as many as wait for it at a time
  double flush_period = 1.0;        ///< s; largest loss if the process is killed
};

class Recorder {
 public:
  /// @throw std::system_error if the file cannot be created. Keeps references to info and topics.
  Recorder(const RunInfo& info,
           const std::string& prefix,
           const std::vector<dds::TopicInfo>& topics,
           const RecorderOptions& options);

  /// Stores a sample; tag.topic is an index into `topics`. Any thread; never waits for the disk.
  void take(const recording::SampleTag& tag, std::string_view bytes) { ring_.push(tag, bytes); }

  /// Adds metadata to the present file. From the thread of drain(). @throw std::system_error as drain().
  void add(const recording::Metadata& metadata);
  /// Writes all stored samples. @throw std::system_error after a write error; the file is then closed and readable.
  void drain();
  /// Calls drain() and finishes the file.
  void close();

  struct Totals {
    std::uint64_t messages = 0;     ///< written
    std::uint64_t overwritten = 0;  ///< overwritten in the ring because the disk was too slow
    std::uint64_t lost = 0;         ///< missing in the sequences of the writers, the overwritten ones included
    std::uint64_t bytes = 0;        ///< in files
    std::vector<std::filesystem::path> files;
  };
  Totals totals() const;

 private:
  void open();
  void finish();

  const RunInfo& info_;
  std::string prefix_;
  const std::vector<dds::TopicInfo>& topics_;
  RecorderOptions options_;
  recording::SampleRing ring_;
  recording::SampleRing::Place place_;
  std::unique_ptr<RunFile> out_;
  std::uint64_t opened_ = 0, flushed_ = 0;  ///< ns since the epoch
  recording::GapCounter<std::pair<std::uint32_t, std::array<std::uint8_t, 16>>> gaps_;
  Totals totals_;
};

}  // namespace tandem::recordings
