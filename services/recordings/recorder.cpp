// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/recorder.h"

#include <cerrno>
#include <system_error>

namespace tandem::recordings {

Recorder::Recorder(const RunInfo& info,
                   const std::string& prefix,
                   const std::vector<dds::TopicInfo>& topics,
                   const RecorderOptions& options)
    : info_(info),
      prefix_(prefix),
      topics_(topics),
      options_(options),
      ring_(options.memory, recording::SampleRing::Memory::kOnDemand) {
  open();
}

void Recorder::open() {
  std::filesystem::path file = options_.file;
  if (!totals_.files.empty())
    file.replace_filename(file.stem().string() + "_" + std::to_string(totals_.files.size() + 1) +
                          file.extension().string());
  if (std::filesystem::exists(file))
    throw std::system_error(EEXIST, std::generic_category(), file.string() + ": is not overwritten");
  out_ = std::make_unique<RunFile>(file, info_, prefix_, topics_);
  totals_.files.push_back(file);
  opened_ = flushed_ = wallClock();
}

void Recorder::add(const recording::Metadata& metadata) {
  if (out_)
    out_->mcap().add(metadata);
}

void Recorder::drain() {
  if (!out_)
    return;
  recording::SampleTag tag;
  std::string bytes;
  try {
    // Only up to the present end: new samples must not prolong this loop without limit.
    const recording::SampleRing::Place end = ring_.extent().end;
    while (place_.byte < end.byte && ring_.next(place_, tag, bytes, totals_.overwritten)) {
      gaps_.see({tag.topic, tag.writer}, static_cast<std::uint32_t>(tag.sequence));
      out_->write(tag, bytes);
    }
    ring_.rewind(place_);
    const std::uint64_t now = wallClock();
    if (static_cast<double>(now - flushed_) > 1e9 * options_.flush_period) {
      out_->mcap().flush();
      flushed_ = now;
    }
    const bool too_large = options_.largest_file > 0 && out_->mcap().size() >= options_.largest_file;
    const bool too_long =
        options_.longest_file > 0.0 && static_cast<double>(now - opened_) >= 1e9 * options_.longest_file;
    if (too_large || too_long) {
      finish();
      open();
    }
  } catch (const std::system_error&) {
    if (out_) {
      try {
        finish();
      } catch (const std::system_error&) {
        // The file ends with its last chunk; the first error is reported.
      }
    }
    throw;
  }
}

void Recorder::finish() {
  const std::unique_ptr<RunFile> out = std::move(out_);
  const auto count = [&] {
    totals_.messages += out->mcap().statistics().messages;
    totals_.bytes += out->mcap().size();
  };
  try {
    out->mcap().close();
  } catch (const std::system_error&) {
    count();
    throw;
  }
  count();
}

void Recorder::close() {
  drain();
  if (out_)
    finish();
}

Recorder::Totals Recorder::totals() const {
  Totals totals = totals_;
  totals.lost = gaps_.lost();
  if (out_) {
    totals.messages += out_->mcap().statistics().messages;
    totals.bytes += out_->mcap().size();
  }
  return totals;
}

}  // namespace tandem::recordings
