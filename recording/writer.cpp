// SPDX-License-Identifier: Apache-2.0
#include "recording/writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "recording/bytes.h"

namespace tandem::recording {
namespace {

void appendRecord(std::string& out, Opcode opcode, std::string_view content) {
  ByteSink(out).number(static_cast<std::uint8_t>(opcode)).number<std::uint64_t>(content.size()).raw(content);
}

void appendSchema(std::string& out, const Schema& schema) {
  std::string content;
  ByteSink(content).number(schema.id).text(schema.name).text(schema.encoding).text(schema.data);
  appendRecord(out, Opcode::kSchema, content);
}

void appendChannel(std::string& out, const Channel& channel) {
  std::string content;
  ByteSink(content)
      .number(channel.id)
      .number(channel.schema)
      .text(channel.topic)
      .text(channel.encoding)
      .map(channel.metadata);
  appendRecord(out, Opcode::kChannel, content);
}

/** Summary section: groups of records, and the offset of each group. */
class Groups {
 public:
  explicit Groups(std::uint64_t start) : start_(start) {}

  void add(Opcode opcode, std::string_view content) { appendRecord(bytes_, opcode, content); }
  std::string& bytes() { return bytes_; }
  /// Ends a group; empty groups are omitted.
  void end(Opcode opcode) {
    const std::uint64_t length = bytes_.size() - begun_;
    if (length > 0) {
      std::string content;
      ByteSink(content).number(static_cast<std::uint8_t>(opcode)).number(start_ + begun_).number(length);
      appendRecord(offsets_, Opcode::kSummaryOffset, content);
    }
    begun_ = bytes_.size();
  }
  /// The whole section, with footer and magic bytes.
  std::string finish() {
    const std::uint64_t offsets_start = start_ + bytes_.size();
    bytes_ += offsets_;
    ByteSink(bytes_).number(static_cast<std::uint8_t>(Opcode::kFooter)).number<std::uint64_t>(20);
    ByteSink(bytes_).number(start_).number(offsets_start);
    ByteSink(bytes_).number(crc32(bytes_)).raw(kMagic);
    return std::move(bytes_);
  }

 private:
  std::uint64_t start_, begun_ = 0;
  std::string bytes_, offsets_;
};

}  // namespace

Writer::Writer(const std::filesystem::path& file, const WriterOptions& options)
    : file_(file), options_(options), compressor_(options.level) {
  descriptor_ = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor_ < 0)
    throw std::system_error(errno, std::generic_category(), file.string() + ": cannot be created");
  std::string begin(kMagic), content;
  ByteSink(content).text(options.profile).text(options.library);
  appendRecord(begin, Opcode::kHeader, content);
  try {
    emit(begin);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

Writer::~Writer() {
  try {
    close();
  } catch (const std::exception&) {
    // The file ends with its last complete record; close() reports errors.
  }
}

void Writer::emit(std::string_view bytes) {
  if (descriptor_ < 0)
    throw std::system_error(EBADF, std::generic_category(), file_.string() + ": is closed");
  std::string_view left = bytes;
  while (!left.empty()) {
    const ssize_t written = ::write(descriptor_, left.data(), left.size());
    if (written < 0 && errno == EINTR)
      continue;
    if (written < 0) {
      const int error = errno;
      // Truncate to the last complete record, so that the next one can begin there.
      if (ftruncate(descriptor_, static_cast<off_t>(position_)) == 0)
        lseek(descriptor_, static_cast<off_t>(position_), SEEK_SET);
      throw std::system_error(error, std::generic_category(), file_.string() + ": cannot be written");
    }
    left.remove_prefix(static_cast<std::size_t>(written));
  }
  position_ += bytes.size();
  crc_ = crc32(bytes, crc_);
}

std::uint16_t Writer::addSchema(const std::string& name, const std::string& encoding, const std::string& data) {
  for (const Schema& known : schemas_) {
    if (known.name == name && known.encoding == encoding && known.data == data)
      return known.id;
  }
  if (schemas_.size() >= std::numeric_limits<std::uint16_t>::max())
    throw std::out_of_range(file_.string() + ": more than 65535 schemas");
  schemas_.push_back({static_cast<std::uint16_t>(schemas_.size() + 1), name, encoding, data});
  schema_defined_.push_back(false);
  return schemas_.back().id;
}

std::uint16_t Writer::addChannel(const std::string& topic,
                                 std::uint16_t schema,
                                 const std::map<std::string, std::string>& metadata,
                                 const std::string& encoding) {
  if (schema > schemas_.size() || channels_.size() >= std::numeric_limits<std::uint16_t>::max())
    throw std::out_of_range(file_.string() + ": schema " + std::to_string(schema) + " of topic " + topic +
                            " was not added, or there are more than 65535 channels");
  channels_.push_back({static_cast<std::uint16_t>(channels_.size() + 1), schema, topic, encoding, metadata});
  channel_defined_.push_back(false);
  return channels_.back().id;
}

/// Writes a channel and its schema before the first message, for readers that stream the file.
void Writer::defineChannel(std::uint16_t id) {
  const Channel& channel = channels_[id - 1u];
  if (channel.schema != 0 && !schema_defined_[channel.schema - 1u]) {
    appendSchema(chunk_, schemas_[channel.schema - 1u]);
    schema_defined_[channel.schema - 1u] = true;
  }
  appendChannel(chunk_, channel);
  channel_defined_[id - 1u] = true;
  chunk_defines_.push_back(id);
}

void Writer::write(const Message& message) {
  if (message.channel == 0 || message.channel > channels_.size())
    throw std::out_of_range(file_.string() + ": channel " + std::to_string(message.channel) + " was not added");
  if (!channel_defined_[message.channel - 1u])
    defineChannel(message.channel);
  chunk_start_ = chunk_messages_ == 0 ? message.log_time : std::min(chunk_start_, message.log_time);
  chunk_end_ = chunk_messages_ == 0 ? message.log_time : std::max(chunk_end_, message.log_time);
  ++chunk_messages_;
  ByteSink(chunk_index_[message.channel]).number(message.log_time).number<std::uint64_t>(chunk_.size());
  ByteSink(chunk_)
      .number(static_cast<std::uint8_t>(Opcode::kMessage))
      .number<std::uint64_t>(22 + message.data.size())
      .number(message.channel)
      .number(message.sequence)
      .number(message.log_time)
      .number(message.publish_time)
      .raw(message.data);
  statistics_.count(message.channel, message.log_time);
  if (chunk_.size() >= options_.chunk_size)
    flush();
}

void Writer::flush() {
  if (chunk_messages_ == 0)
    return;
  std::string compressed, out;
  const bool compress = options_.level > 0;
  if (compress)
    compressor_.append(chunk_, compressed);
  const std::string& records = compress ? compressed : chunk_;
  const std::string_view name = compress ? "zstd" : "";
  ChunkEntry entry{chunk_start_, chunk_end_, position_, 0, 0, records.size(), chunk_.size(), {}};
  entry.length = kRecordHead + 28 + 4 + name.size() + 8 + records.size();
  ByteSink(out)
      .number(static_cast<std::uint8_t>(Opcode::kChunk))
      .number(entry.length - kRecordHead)
      .number(chunk_start_)
      .number(chunk_end_)
      .number<std::uint64_t>(chunk_.size())
      .number(crc32(chunk_))
      .text(name)
      .number<std::uint64_t>(records.size())
      .raw(records);
  for (const auto& [channel, index] : chunk_index_) {
    entry.index_offsets[channel] = position_ + out.size();
    std::string content;
    ByteSink(content).number(channel).text(index);
    appendRecord(out, Opcode::kMessageIndex, content);
  }
  entry.index_length = out.size() - entry.length;
  Statistics counted = in_file_;
  for (const auto& [channel, index] : chunk_index_) {
    counted.per_channel[channel] += index.size() / 16;
    counted.messages += index.size() / 16;
  }
  counted.start = std::min(counted.start, chunk_start_);
  counted.end = std::max(counted.end, chunk_end_);
  const std::uint64_t messages = std::exchange(chunk_messages_, 0);
  chunk_.clear();
  chunk_index_.clear();
  const std::vector<std::uint16_t> defines = std::exchange(chunk_defines_, {});
  try {
    emit(out);
  } catch (...) {
    lost_ += messages;
    statistics_ = in_file_;
    for (std::uint16_t channel : defines) {
      channel_defined_[channel - 1u] = false;
      if (channels_[channel - 1u].schema != 0)
        schema_defined_[channels_[channel - 1u].schema - 1u] = false;
    }
    throw;
  }
  in_file_ = std::move(counted);
  chunks_.push_back(std::move(entry));
}

void Writer::attach(const Attachment& attachment) {
  std::string content, out;
  ByteSink(content)
      .number(attachment.log_time)
      .number(attachment.create_time)
      .text(attachment.name)
      .text(attachment.media_type)
      .number<std::uint64_t>(attachment.data.size())
      .raw(attachment.data);
  ByteSink(content).number(crc32(content));
  appendRecord(out, Opcode::kAttachment, content);
  Place place{position_, out.size(), {}};
  ByteSink(place.index)
      .number(attachment.log_time)
      .number(attachment.create_time)
      .number<std::uint64_t>(attachment.data.size())
      .text(attachment.name)
      .text(attachment.media_type);
  emit(out);
  attachments_.push_back(std::move(place));
}

void Writer::add(const Metadata& metadata) {
  std::string content, out;
  ByteSink(content).text(metadata.name).map(metadata.values);
  appendRecord(out, Opcode::kMetadata, content);
  Place place{position_, out.size(), {}};
  ByteSink(place.index).text(metadata.name);
  emit(out);
  metadata_.push_back(std::move(place));
}

std::string Writer::summary() const {
  std::string content;
  ByteSink(content).number(crc_);
  std::string end;
  appendRecord(end, Opcode::kDataEnd, content);
  Groups groups(position_ + end.size());
  for (const Schema& schema : schemas_)
    appendSchema(groups.bytes(), schema);
  groups.end(Opcode::kSchema);
  for (const Channel& channel : channels_)
    appendChannel(groups.bytes(), channel);
  groups.end(Opcode::kChannel);
  std::string counts;
  for (const auto& [channel, count] : in_file_.per_channel)
    ByteSink(counts).number(channel).number(count);
  content.clear();
  ByteSink(content)
      .number(in_file_.messages)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(channels_.size()))
      .number(static_cast<std::uint32_t>(attachments_.size()))
      .number(static_cast<std::uint32_t>(metadata_.size()))
      .number(static_cast<std::uint32_t>(chunks_.size()))
      .number(in_file_.messages == 0 ? std::uint64_t{0} : in_file_.start)
      .number(in_file_.end)
      .text(counts);
  groups.add(Opcode::kStatistics, content);
  groups.end(Opcode::kStatistics);
  for (const ChunkEntry& chunk : chunks_) {
    std::string offsets;
    for (const auto& [channel, offset] : chunk.index_offsets)
      ByteSink(offsets).number(channel).number(offset);
    content.clear();
    ByteSink(content).number(chunk.start).number(chunk.end).number(chunk.offset).number(chunk.length).text(offsets);
    ByteSink(content).number(chunk.index_length).text(options_.level > 0 ? "zstd" : "");
    ByteSink(content).number(chunk.compressed).number(chunk.uncompressed);
    groups.add(Opcode::kChunkIndex, content);
  }
  groups.end(Opcode::kChunkIndex);
  const auto index = [&](Opcode opcode, const std::vector<Place>& places) {
    for (const Place& place : places) {
      content.clear();
      ByteSink(content).number(place.offset).number(place.length).raw(place.index);
      groups.add(opcode, content);
    }
    groups.end(opcode);
  };
  index(Opcode::kAttachmentIndex, attachments_);
  index(Opcode::kMetadataIndex, metadata_);
  return end + groups.finish();
}

void Writer::sync() {
  flush();
  if (fdatasync(descriptor_) != 0)
    throw std::system_error(errno, std::generic_category(), file_.string() + ": cannot be synced");
}

void Writer::close() {
  if (descriptor_ < 0)
    return;
  std::exception_ptr failure;
  // The disk space that was too small for the last chunk may be sufficient for the summary.
  for (const bool last : {false, true}) {
    try {
      last ? emit(summary()) : flush();
    } catch (...) {
      failure = failure ? failure : std::current_exception();
    }
  }
  fdatasync(descriptor_);
  ::close(descriptor_);
  descriptor_ = -1;
  if (failure)
    std::rethrow_exception(failure);
}

}  // namespace tandem::recording
