// SPDX-License-Identifier: Apache-2.0
/** @file Compression and checksums of chunks. */
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace tandem::recording {

/// CRC-32 as MCAP has it (that of zlib), continued from `crc`; 0 to begin.
std::uint32_t crc32(std::string_view bytes, std::uint32_t crc = 0);

/** zstd with its working memory kept from chunk to chunk. */
class Compressor {
 public:
  /// @param level 1 (fast) to 19
  explicit Compressor(int level);
  ~Compressor();
  /// Appends the compressed bytes.
  void append(std::string_view bytes, std::string& out);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

/// The bytes of a chunk. @param compression "zstd" or "". @throw std::runtime_error where it cannot be.
std::string decompress(std::string_view bytes, std::string_view compression, std::uint64_t expected_size);

}  // namespace tandem::recording
