// SPDX-License-Identifier: Apache-2.0
/** @file MCAP writer: chunks with message indices, attachments, metadata, and a summary with index. Data passed by
 * flush() survives a crash of the process.
 *
 * What flush() has handed over survives the death of the process: readers stream a file without summary. Where the disk
 * is full the file is cut back to its last whole record, so that it stays readable.
 */
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "recording/compression.h"
#include "recording/records.h"

namespace tandem::recording {

struct WriterOptions {
  std::string profile = "ros2";
  std::string library = "tandem";
  std::size_t chunk_size = 1 << 20;  ///< bytes before compression
  int level = 1;                     ///< of zstd; 0: chunks are not compressed
};

/** One file. Not for several threads at once. */
class Writer {
 public:
  /// Creates the file, or empties it. @throw std::system_error, as all others do, naming the file.
  explicit Writer(const std::filesystem::path& file, const WriterOptions& options = {});
  /// As close(), errors ignored.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// @return its id. The same schema twice is one.
  std::uint16_t addSchema(const std::string& name, const std::string& encoding, const std::string& data);
  /// @return its id, a new one with every call.
  std::uint16_t addChannel(const std::string& topic,
                           std::uint16_t schema,
                           const std::map<std::string, std::string>& metadata = {},
                           const std::string& encoding = "cdr");
  /// @throw std::out_of_range for a channel that was not added.
  void write(const Message& message);
  void attach(const Attachment& attachment);
  void add(const Metadata& metadata);

  /// Ends the chunk and hands it to the kernel. Where that fails its messages are lost, and counted.
  void flush();
  /// flush(), then the summary; the file is whole afterwards. Where the disk has no room for it the file ends with its
  /// last chunk. Every later call but this one fails.
  void close();

  const std::filesystem::path& file() const { return file_; }
  /// Bytes in the file, and in the chunk that is being filled.
  std::uint64_t size() const { return position_ + chunk_.size(); }
  /// What was handed over, the chunk being filled included.
  const Statistics& statistics() const { return statistics_; }
  /// Messages that could not be written.
  std::uint64_t lost() const { return lost_; }

 private:
  struct ChunkEntry {
    std::uint64_t start, end, offset, length, index_length, compressed, uncompressed;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };
  struct Place {
    std::uint64_t offset, length;
    std::string index;  ///< of the index record what follows offset and length
  };

  void emit(std::string_view bytes);
  std::string summary() const;
  void defineChannel(std::uint16_t channel);

  std::filesystem::path file_;
  WriterOptions options_;
  Compressor compressor_;
  int descriptor_ = -1;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;  ///< of all bytes so far
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::vector<bool> channel_defined_, schema_defined_;  ///< in the data section
  std::string chunk_;
  std::uint64_t chunk_start_ = 0, chunk_end_ = 0, chunk_messages_ = 0;
  std::map<std::uint16_t, std::string> chunk_index_;  ///< per channel: log times and offsets, as they are written
  std::vector<std::uint16_t> chunk_defines_;
  Statistics statistics_, in_file_;
  std::uint64_t lost_ = 0;
  std::vector<ChunkEntry> chunks_;
  std::vector<Place> attachments_, metadata_;
};

}  // namespace tandem::recording
