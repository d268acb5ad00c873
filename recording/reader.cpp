// SPDX-License-Identifier: Apache-2.0
#include "recording/reader.h"

#include <algorithm>

#include "recording/bytes.h"
#include "recording/compression.h"
#include "recording/parsing.h"

namespace tandem::recording {
namespace {

constexpr std::uint64_t kFooterLength = 20;
constexpr std::uint64_t kTail = kRecordHead + kFooterLength + kMagic.size();

struct Head {
  Opcode opcode;
  std::uint64_t length;
};

Head headOf(std::string_view bytes) {
  ByteSource source(bytes);
  const auto opcode = source.number<std::uint8_t>();
  return {static_cast<Opcode>(opcode), source.number<std::uint64_t>()};
}

}  // namespace

Reader::Reader(const std::filesystem::path& file, Open how, std::uint64_t memory)
    : file_(file), stream_(file, std::ios::binary), memory_(memory) {
  std::error_code error;
  if (!stream_ || !std::filesystem::is_regular_file(file, error))
    throw Error(file.string() + ": found no readable file, expected a recording (MCAP)");
  size_ = std::filesystem::file_size(file);
  const std::string magic = bytes(0, std::min<std::uint64_t>(size_, kMagic.size()));
  if (magic != kMagic)
    throw Error(file.string() + ": is no MCAP file: it does not begin with MCAP's magic bytes");
  if (how != Open::kScan && readSummary())
    return;
  if (how == Open::kIndexed)
    throw Error(file.string() + ": has no index: its recording did not end, or it is damaged");
  forget();
  scan();
}

std::string Reader::bytes(std::uint64_t offset, std::uint64_t length) {
  if (offset > size_ || length > size_ - offset)
    throw std::out_of_range("found " + std::to_string(size_) + " bytes, expected " + std::to_string(length) + " from " +
                            std::to_string(offset) + " on");
  expectRoom(length, offset);
  std::string out(length, '\0');
  stream_.clear();
  stream_.seekg(static_cast<std::streamoff>(offset));
  if (!stream_.read(out.data(), static_cast<std::streamsize>(length)))
    throw Error(file_.string() + ": cannot be read at byte " + std::to_string(offset));
  return out;
}

void Reader::expectRoom(std::uint64_t size, std::uint64_t offset) const {
  if (size > memory_)
    throw Error(file_.string() + ": at byte " + std::to_string(offset) + ": found records of " + std::to_string(size) +
                " bytes that are needed at one time, expected at most " + std::to_string(memory_));
}

void Reader::report(std::uint64_t offset, const std::string& what) {
  const std::string text = file_.string() + ": at byte " + std::to_string(offset) + ": " + what;
  if (std::find(damage_.begin(), damage_.end(), text) == damage_.end())
    damage_.push_back(text);
}

void Reader::forget() {
  finished_ = false;
  schemas_.clear();
  channels_.clear();
  statistics_ = {};
  metadata_.clear();
  attachments_.clear();
  attachment_extents_.clear();
  parts_.clear();
}

/// @return whether the file has a valid summary.
bool Reader::readSummary() {
  try {
    if (size_ < 2 * kMagic.size() + kTail)
      return false;
    const std::string tail = bytes(size_ - kTail, kTail);
    ByteSource footer(std::string_view(tail).substr(kRecordHead));
    if (!tail.ends_with(kMagic) || headOf(tail).opcode != Opcode::kFooter || headOf(tail).length != kFooterLength)
      return false;
    const auto start = footer.number<std::uint64_t>();
    footer.number<std::uint64_t>();
    const auto crc = footer.number<std::uint32_t>();
    if (start == 0 || start > size_ - kTail)
      return false;
    const std::string summary = bytes(start, size_ - kMagic.size() - 4 - start);
    if (crc != 0 && crc32(summary) != crc) {
      report(start, "the checksum of the summary is wrong; the whole file is looked at");
      return false;
    }
    const std::string first = bytes(kMagic.size(), kRecordHead);
    const std::string content =
        bytes(kMagic.size() + kRecordHead, std::min<std::uint64_t>(headOf(first).length, size_));
    ByteSource header(content);
    profile_ = header.text();
    library_ = header.text();
    takeSummary(std::string_view(summary).substr(0, summary.size() - (kRecordHead + kFooterLength - 4)));
    // False for a file without a chunk index, or with messages outside of chunks.
    return statistics_.chunks == parts_.size() && (statistics_.messages == 0 || !parts_.empty());
  } catch (const std::out_of_range& error) {
    report(size_ - kTail, std::string("the summary is damaged: ") + error.what());
    return false;
  }
}

void Reader::takeSummary(std::string_view summary) {
  forEachRecord(summary, [this](Opcode opcode, std::string_view content) {
    ByteSource source(content);
    if (opcode == Opcode::kSchema || opcode == Opcode::kChannel) {
      takeDefinition(opcode, content);
    } else if (opcode == Opcode::kStatistics) {
      statistics_.messages = source.number<std::uint64_t>();
      source.raw(2 + 4 + 4 + 4);
      statistics_.chunks = source.number<std::uint32_t>();
      statistics_.start = source.number<std::uint64_t>();
      statistics_.end = source.number<std::uint64_t>();
      for (ByteSource counts(source.text()); !counts.empty();) {
        const auto channel = counts.number<std::uint16_t>();
        statistics_.per_channel[channel] = counts.number<std::uint64_t>();
      }
    } else if (opcode == Opcode::kChunkIndex) {
      const auto start = source.number<std::uint64_t>(), end = source.number<std::uint64_t>();
      const auto offset = source.number<std::uint64_t>();
      parts_.push_back({start, end, offset, source.number<std::uint64_t>(), true});
    } else if (opcode == Opcode::kAttachmentIndex) {
      attachment_extents_.push_back({source.number<std::uint64_t>(), source.number<std::uint64_t>()});
      Attachment attachment;
      attachment.log_time = source.number<std::uint64_t>();
      attachment.create_time = source.number<std::uint64_t>();
      source.number<std::uint64_t>();
      attachment.name = source.text();
      attachment.media_type = source.text();
      attachments_.push_back(std::move(attachment));
    } else if (opcode == Opcode::kMetadataIndex) {
      const auto offset = source.number<std::uint64_t>(), length = source.number<std::uint64_t>();
      takeMetadata(std::string_view(bytes(offset, length)).substr(kRecordHead));
    }
  });
  finished_ = true;
}

void Reader::takeDefinition(Opcode opcode, std::string_view content) {
  ByteSource source(content);
  const auto id = source.number<std::uint16_t>();
  if (opcode == Opcode::kSchema) {
    Schema schema{id, std::string(source.text()), std::string(source.text()), {}};
    schema.data = source.text();
    schemas_[id] = std::move(schema);
  } else {
    Channel channel;
    channel.id = id;
    channel.schema = source.number<std::uint16_t>();
    channel.topic = source.text();
    channel.encoding = source.text();
    channel.metadata = source.map();
    channels_[id] = std::move(channel);
  }
}

void Reader::takeMetadata(std::string_view content) {
  ByteSource source(content);
  std::string name(source.text());
  metadata_.push_back({std::move(name), source.map()});
}

void Reader::takeAttachment(std::uint64_t offset, const std::string& content) {
  ByteSource source(content);
  Attachment attachment;
  attachment.log_time = source.number<std::uint64_t>();
  attachment.create_time = source.number<std::uint64_t>();
  attachment.name = source.text();
  attachment.media_type = source.text();
  source.raw(source.number<std::uint64_t>());
  const auto crc = source.number<std::uint32_t>();
  if (crc != 0 && crc32(std::string_view(content).substr(0, content.size() - 4)) != crc)
    report(offset, "the checksum of attachment " + attachment.name + " is wrong");
  attachments_.push_back(std::move(attachment));
  attachment_extents_.push_back({offset, kRecordHead + content.size()});
}

void Reader::scan() {
  std::uint64_t offset = kMagic.size();
  std::uint32_t crc = crc32(kMagic);
  bool more = true;
  while (more && offset < size_) {
    std::string head, content;
    try {
      head = bytes(offset, kRecordHead);
      content = bytes(offset + kRecordHead, headOf(head).length);
    } catch (const std::out_of_range&) {
      break;  // truncated within a record
    }
    try {
      more = scanRecord(headOf(head).opcode, offset, content, crc);
    } catch (const std::out_of_range& error) {
      report(offset, std::string("a record is damaged: ") + error.what());
    }
    crc = crc32(content, crc32(head, crc));
    offset += kRecordHead + content.size();
  }
  finished_ = !more && size_ - offset >= kTail && bytes(size_ - kMagic.size(), kMagic.size()) == kMagic;
  if (!finished_)
    report(offset, "the file is incomplete; all records before this point are valid");
}

/// @return false at the end of the data section.
bool Reader::scanRecord(Opcode opcode, std::uint64_t offset, const std::string& content, std::uint32_t crc_before) {
  ByteSource source(content);
  switch (opcode) {
    case Opcode::kHeader:
      profile_ = source.text();
      library_ = source.text();
      break;
    case Opcode::kSchema:
    case Opcode::kChannel:
      takeDefinition(opcode, content);
      break;
    case Opcode::kMessage: {
      const Message message = messageOf(content);
      statistics_.count(message.channel, message.log_time);
      parts_.push_back({message.log_time, message.log_time, offset, kRecordHead + content.size(), false});
      break;
    }
    case Opcode::kChunk:
      scanChunk(offset, content);
      break;
    case Opcode::kAttachment:
      takeAttachment(offset, content);
      break;
    case Opcode::kMetadata:
      takeMetadata(content);
      break;
    case Opcode::kDataEnd: {
      const auto crc = source.number<std::uint32_t>();
      if (crc != 0 && crc != crc_before) {
        report(offset, "the checksum of the data is wrong");
        leaveOutUnchecked(offset);
      }
      return false;
    }
    default:
      break;  // indices are not needed here; unknown records are skipped
  }
  return true;
}

/// Messages outside of chunks are covered only by the checksum of the data section: a flipped bit can turn another
/// record into a message.
void Reader::leaveOutUnchecked(std::uint64_t offset) {
  const auto left_out = std::erase_if(parts_, [](const Part& part) { return !part.is_chunk; });
  if (left_out > 0)
    report(offset, std::to_string(left_out) + " messages outside of chunks are left out");
}

void Reader::scanChunk(std::uint64_t offset, const std::string& content) {
  try {
    const std::string records = unpack(content);
    Part part{std::numeric_limits<std::uint64_t>::max(), 0, offset, kRecordHead + content.size(), true};
    forEachRecord(records, [&](Opcode opcode, std::string_view record) {
      if (opcode == Opcode::kSchema || opcode == Opcode::kChannel) {
        takeDefinition(opcode, record);
      } else if (opcode == Opcode::kMessage) {
        const Message message = messageOf(record);
        statistics_.count(message.channel, message.log_time);
        part.start = std::min(part.start, message.log_time);
        part.end = std::max(part.end, message.log_time);
      }
    });
    ++statistics_.chunks;
    parts_.push_back(part);
  } catch (const std::runtime_error& error) {
    report(offset, std::string("a chunk is left out: ") + error.what());
  }
}

/// Records of a chunk. @param content  chunk record without opcode and length
std::string Reader::unpack(const std::string& content) const {
  ByteSource source(content);
  source.raw(16);  // start and end time: the times of the messages are used
  const auto size = source.number<std::uint64_t>();
  if (size > memory_)
    throw std::runtime_error("found a chunk of " + std::to_string(size) + " bytes, expected at most " +
                             std::to_string(memory_));
  const auto crc = source.number<std::uint32_t>();
  const std::string_view compression = source.text();
  const std::string_view packed = source.raw(source.number<std::uint64_t>());
  std::string records = decompress(packed, compression, size);
  if (crc != 0 && crc32(records) != crc)
    throw std::runtime_error("its checksum is wrong");
  return records;
}

std::string Reader::attachmentData(std::size_t index) {
  const Extent extent = attachment_extents_.at(index);
  try {
    const std::string content = bytes(extent.offset + kRecordHead, extent.length - kRecordHead);
    ByteSource source(content);
    source.raw(16);
    source.text();
    source.text();
    std::string data(source.raw(source.number<std::uint64_t>()));
    const auto crc = source.number<std::uint32_t>();
    if (crc != 0 && crc32(std::string_view(content).substr(0, content.size() - 4)) != crc)
      throw std::out_of_range("its checksum is wrong");
    return data;
  } catch (const std::out_of_range& error) {
    throw Error(file_.string() + ": attachment " + attachments_[index].name + ": " + error.what());
  }
}

}  // namespace tandem::recording
