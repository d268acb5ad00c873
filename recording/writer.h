// SPDX-License-Identifier: Apache-2.0
/** @file MCAP writer: chunks with message indices, attachments, metadata, and a summary with index. Data passed by
 * flush() survives a crash of the process.
 *
 * After a crash of the process, readers stream the file without summary. On a full disk the file is truncated to its
 * last complete record, so that it stays readable.
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
  std::size_t chunk_size = 1 << 20;  ///< bytes before compression at which a chunk ends
  int level = 1;                     ///< of zstd; 0: chunks are not compressed
};

/** Writer of one file. Not thread-safe. */
class Writer {
 public:
  /// Creates the file, or truncates an existing one. @throw std::system_error that names the file, as do all other
  /// functions.
  explicit Writer(const std::filesystem::path& file, const WriterOptions& options = {});
  /// As close(), but ignores errors.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// @return id of the schema, the same one for equal schemas.
  std::uint16_t addSchema(const std::string& name, const std::string& encoding, const std::string& data);
  /// @return id of the channel, a new one in every call.
  std::uint16_t addChannel(const std::string& topic,
                           std::uint16_t schema,
                           const std::map<std::string, std::string>& metadata = {},
                           const std::string& encoding = "cdr");
  /// @throw std::out_of_range for a channel that was not added.
  void write(const Message& message);
  void attach(const Attachment& attachment);
  void add(const Metadata& metadata);

  /// Ends the chunk and passes it to the kernel. After an error its messages are lost, and counted.
  void flush();
  /// Calls flush(), and returns when the data are on the disk: they survive a power cut.
  void sync();
  /// Calls flush() and writes the summary, which completes the file. Without disk space for the summary the file ends
  /// with its last chunk. Later calls of other functions fail.
  void close();

  const std::filesystem::path& file() const { return file_; }
  /// Bytes in the file and in the present chunk.
  std::uint64_t size() const { return position_ + chunk_.size(); }
  /// Statistics of all messages, those in the present chunk included.
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
    std::string index;  ///< content of the index record after offset and length
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
  std::map<std::uint16_t, std::string> chunk_index_;  ///< per channel: log times and offsets, in the format of the file
  std::vector<std::uint16_t> chunk_defines_;
  Statistics statistics_, in_file_;
  std::uint64_t lost_ = 0;
  std::vector<ChunkEntry> chunks_;
  std::vector<Place> attachments_, metadata_;
};

}  // namespace tandem::recording
