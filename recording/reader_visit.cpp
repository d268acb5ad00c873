// SPDX-License-Identifier: Apache-2.0
/** @file Visits of messages in the order of their times, one chunk after the other. */
#include <algorithm>
#include <memory>
#include <queue>
#include <tuple>

#include "recording/parsing.h"
#include "recording/reader.h"

namespace tandem::recording {

/** Messages of loaded parts that were not visited yet; the earliest one is on top. */
struct Reader::Loaded {
  struct Entry {
    std::uint64_t order;  ///< order of loading, for equal times
    std::shared_ptr<const std::string> records;
    Message message;
  };
  struct Later {
    bool operator()(const Entry& a, const Entry& b) const {
      return std::tie(a.message.log_time, a.order) > std::tie(b.message.log_time, b.order);
    }
  };
  std::uint64_t bytes = 0;  ///< of all records in the queue
  std::priority_queue<Entry, std::vector<Entry>, Later> queue;

  /// Counts the records until none of their messages is in use.
  std::shared_ptr<const std::string> keep(std::string records) {
    bytes += records.size();
    return {new std::string(std::move(records)), [this](const std::string* used) {
              bytes -= used->size();
              delete used;
            }};
  }
  std::uint64_t next = 0;
};

void Reader::load(const Part& part, const Selection& selection, Loaded& loaded) {
  const auto take = [&](const std::shared_ptr<const std::string>& records, const Message& message) {
    const auto channel = channels_.find(message.channel);
    if (channel == channels_.end()) {
      report(part.offset, "a message of a channel that is not in the file");
    } else if (message.log_time < part.start || message.log_time > part.end) {
      report(part.offset, "a message outside of the times in the index of its chunk is left out");
    } else if (message.log_time >= selection.from && message.log_time <= selection.to &&
               (!selection.channel || selection.channel(channel->second))) {
      loaded.queue.push({loaded.next++, records, message});
    }
  };
  try {
    const std::string content = bytes(part.offset + kRecordHead, part.length - kRecordHead);
    if (!part.is_chunk) {
      const auto records = loaded.keep(content);
      take(records, messageOf(*records));
      return;
    }
    const auto records = loaded.keep(unpack(content));
    expectRoom(loaded.bytes, part.offset);
    forEachRecord(*records, [&](Opcode opcode, std::string_view record) {
      if (opcode == Opcode::kMessage)
        take(records, messageOf(record));
    });
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    report(part.offset, std::string("a chunk is left out: ") + error.what());
  }
}

void Reader::forEach(const Selection& selection, const std::function<bool(const Channel&, const Message&)>& visit) {
  std::vector<Part> parts;
  for (const Part& part : parts_) {
    if (part.start <= selection.to && part.end >= selection.from)
      parts.push_back(part);
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.start < b.start; });
  Loaded loaded;
  for (auto part = parts.begin(); part != parts.end() || !loaded.queue.empty();) {
    // Chunks may overlap: load every part that begins before the next message.
    if (part != parts.end() && (loaded.queue.empty() || part->start <= loaded.queue.top().message.log_time)) {
      load(*part++, selection, loaded);
      continue;
    }
    const Loaded::Entry entry = loaded.queue.top();
    loaded.queue.pop();
    if (!visit(channels_.at(entry.message.channel), entry.message))
      return;
  }
}

}  // namespace tandem::recording
