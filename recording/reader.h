// SPDX-License-Identifier: Apache-2.0
/** @file MCAP reader: complete files by index, unfinished and damaged files by streaming. A truncated file yields all
 * records before the cut.
 *
 * Cut at any byte, a file gives what was whole before. A chunk whose checksum is wrong is left out, and reported.
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

/** Which messages. */
struct Selection {
  std::function<bool(const Channel&)> channel;  ///< empty: all
  std::uint64_t from = 0;                       ///< log time, ns, this one included
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();
};

/** One file. Not for several threads at once. */
class Reader {
 public:
  enum class Open {
    kFast,  ///< by the index, if there is one
    kScan,  ///< looks at every byte, and checks every checksum
  };

  /// @throw Error where the file cannot be read or is no MCAP file.
  explicit Reader(const std::filesystem::path& file, Open how = Open::kFast);

  const std::filesystem::path& file() const { return file_; }
  const std::string& profile() const { return profile_; }
  const std::string& library() const { return library_; }
  /// Whether it was closed: the summary and the end are there.
  bool finished() const { return finished_; }
  /// What is wrong with the file, for people; grows while it is read, and stays empty for a good one.
  const std::vector<std::string>& damage() const { return damage_; }

  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  const Statistics& statistics() const { return statistics_; }
  /// In the order of the file.
  const std::vector<Metadata>& metadata() const { return metadata_; }
  /// Without their data.
  const std::vector<Attachment>& attachments() const { return attachments_; }
  /// Data of the attachment of that place in attachments(). @throw Error where its checksum is wrong.
  std::string attachmentData(std::size_t index);

  /// Visits messages in the order of their log times until `visit` returns false. Their data lives until it returns.
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
  std::uint64_t size_ = 0;
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
