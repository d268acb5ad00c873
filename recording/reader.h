// SPDX-License-Identifier: Apache-2.0
/** @file MCAP reader: complete files by index, unfinished and damaged files by streaming.
 *
 * A truncated file yields all complete records before the cut. Chunks with a wrong checksum are skipped and reported.
 */
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "recording/records.h"

namespace tandem::recording {

/** Selection of messages. */
struct Selection {
  std::function<bool(const Channel&)> channel;  ///< empty: all
  std::uint64_t from = 0;                       ///< log time, ns, inclusive
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();
};

/** Reader of one file. Not thread-safe. */
class Reader {
 public:
  enum class Open {
    kFast,     ///< by the index, if the file has one
    kScan,     ///< reads the whole file, and checks every checksum
    kIndexed,  ///< by the index; a file without one is refused
  };

  /// @param memory  bytes of records that may be in memory at a time; a file that needs more is refused
  /// @throw Error if the file cannot be read, is no MCAP file, or is refused.
  explicit Reader(const std::filesystem::path& file,
                  Open how = Open::kFast,
                  std::uint64_t memory = std::numeric_limits<std::uint64_t>::max());

  const std::filesystem::path& file() const { return file_; }
  const std::string& profile() const { return profile_; }
  const std::string& library() const { return library_; }
  /// Whether the file was closed: it has a summary and the final magic bytes.
  bool finished() const { return finished_; }
  /// Descriptions of damage found so far; grows during reading, empty for an intact file.
  const std::vector<std::string>& damage() const { return damage_; }

  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  const Statistics& statistics() const { return statistics_; }
  /// In the order of the file.
  const std::vector<Metadata>& metadata() const { return metadata_; }
  /// Without their data.
  const std::vector<Attachment>& attachments() const { return attachments_; }
  /// Data of attachments()[index]. @throw Error if its checksum is wrong.
  std::string attachmentData(std::size_t index);

  /// Visits messages in the order of their log times until `visit` returns false. Their data is valid until `visit`
  /// returns. @throw Error if the file cannot be read, or the records of one time need more memory than allowed.
  void forEach(const Selection& selection, const std::function<bool(const Channel&, const Message&)>& visit);

 private:
  struct Part {  ///< a chunk, or a message outside of chunks
    std::uint64_t start, end, offset, length;
    bool is_chunk;
  };
  struct Extent {
    std::uint64_t offset, length;
  };
  struct Loaded;

  std::string bytes(std::uint64_t offset, std::uint64_t length);
  void expectRoom(std::uint64_t size, std::uint64_t offset) const;
  void report(std::uint64_t offset, const std::string& what);
  bool readSummary();
  void takeSummary(std::string_view summary);
  void forget();
  void scan();
  bool scanRecord(Opcode opcode, std::uint64_t offset, const std::string& content, std::uint32_t crc_before);
  void leaveOutUnchecked(std::uint64_t offset);
  void scanChunk(std::uint64_t offset, const std::string& content);
  std::string unpack(const std::string& content) const;
  void takeDefinition(Opcode opcode, std::string_view content);
  void takeMetadata(std::string_view content);
  void takeAttachment(std::uint64_t offset, const std::string& content);
  void load(const Part& part, const Selection& selection, Loaded& loaded);

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, memory_;
  std::string profile_, library_;
  bool finished_ = false;
  std::vector<std::string> damage_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  Statistics statistics_;
  std::vector<Metadata> metadata_;
  std::vector<Attachment> attachments_;
  std::vector<Extent> attachment_extents_;
  std::vector<Part> parts_;
};

}  // namespace tandem::recording
