// SPDX-License-Identifier: Apache-2.0
/** @file MCAP recordings, opened by index and by scan: messages are in order and inside the file's limits, damage and
 * errors name the file, and what is read can be written to a new file that reads the same. */
#include "recording/reader.h"
#include "recording/writer.h"
#include "tests/fuzz/harness.h"

using namespace tandem::recording;
using tandem::fuzz::expect;

namespace {

constexpr std::size_t kMostMessages = 2000;

struct Row {
  std::string topic, data;
  std::uint32_t sequence;
  std::uint64_t log_time;
  bool operator==(const Row&) const = default;
};

std::vector<Row> rowsOf(Reader& reader) {
  std::vector<Row> rows;
  std::uint64_t last = 0;
  reader.forEach({}, [&](const Channel& channel, const Message& message) {
    expect(message.log_time >= last, "messages are in the order of their log times");
    last = message.log_time;
    expect(reader.channels().contains(message.channel) && channel.id == message.channel, "a message has a channel");
    rows.push_back({channel.topic, std::string(message.data), message.sequence, message.log_time});
    return rows.size() < kMostMessages;
  });
  return rows;
}

/// The same messages in a new file.
void writeAgain(const std::vector<Row>& rows) {
  const tandem::fuzz::MemoryFile file("");
  {
    Writer writer(file.path(), {.chunk_size = 200});
    std::map<std::string, std::uint16_t> channels;
    for (const Row& row : rows) {
      if (!channels.contains(row.topic))
        channels[row.topic] = writer.addChannel(row.topic, writer.addSchema("p/msg/T", "ros2msg", ""));
      writer.write({channels[row.topic], row.sequence, row.log_time, 0, row.data});
    }
  }
  Reader reader(file.path());
  expect(reader.finished() && reader.damage().empty(), "a written file is whole");
  expect(rowsOf(reader) == rows, "messages are read as they were written");
}

void open(const std::string& path, Reader::Open how) {
  try {
    Reader reader(path, how);
    const std::vector<Row> rows = rowsOf(reader);
    for (std::size_t i = 0; i < std::min<std::size_t>(reader.attachments().size(), 20); ++i) {
      try {
        reader.attachmentData(i);
      } catch (const Error& error) {
        expect(std::string_view(error.what()).starts_with(path), "an error names its file", error.what());
      }
    }
    for (const std::string& text : reader.damage())
      expect(text.starts_with(path + ": at byte "), "damage has a file and a place", text);
    if (how == Reader::Open::kScan && rows.size() < 200)
      writeAgain(rows);
  } catch (const Error& error) {
    expect(std::string_view(error.what()).starts_with(path), "an error names its file", error.what());
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const tandem::fuzz::MemoryFile file(tandem::fuzz::textOf(data, size));
  open(file.path(), Reader::Open::kFast);
  open(file.path(), Reader::Open::kScan);
  return 0;
}
