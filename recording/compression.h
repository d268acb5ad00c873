// SPDX-License-Identifier: Apache-2.0
/** @file Compression and checksums of chunks. */
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace tandem::recording {

/// CRC-32 of MCAP (as in zlib), continued from `crc`; initial value 0.
std::uint32_t crc32(std::string_view bytes, std::uint32_t crc = 0);

/** zstd compressor that reuses its working memory for all chunks. */
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

/// Decompresses a chunk. @param compression "zstd" or "". @throw std::runtime_error for damaged data.
std::string decompress(std::string_view bytes, std::string_view compression, std::uint64_t expected_size);

}  // namespace tandem::recording
