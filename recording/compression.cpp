// SPDX-License-Identifier: Apache-2.0
#include "recording/compression.h"

#include <zlib.h>
#include <zstd.h>

#include <stdexcept>

namespace tandem::recording {
namespace {

constexpr std::uint64_t kLargestChunk = 1ull << 30;  // bytes; a larger size is treated as damage
constexpr std::uint64_t kLargestRatio = 1 << 15;     // of zstd: a block of 128 KiB takes at least 4 bytes

void checkZstd(std::size_t result) {
  if (ZSTD_isError(result))
    throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(result));
}

}  // namespace

struct Compressor::Context {
  ZSTD_CCtx* zstd = ZSTD_createCCtx();
  ~Context() { ZSTD_freeCCtx(zstd); }
};

std::uint32_t crc32(std::string_view bytes, std::uint32_t crc) {
  return static_cast<std::uint32_t>(::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

Compressor::Compressor(int level) : context_(std::make_unique<Context>()) {
  checkZstd(ZSTD_CCtx_setParameter(context_->zstd, ZSTD_c_compressionLevel, level));
}

Compressor::~Compressor() = default;

void Compressor::append(std::string_view bytes, std::string& out) {
  const std::size_t begin = out.size();
  out.resize(begin + ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(context_->zstd, out.data() + begin, out.size() - begin, bytes.data(), bytes.size());
  checkZstd(size);
  out.resize(begin + size);
}

std::string decompress(std::string_view bytes, std::string_view compression, std::uint64_t expected_size) {
  if (expected_size > kLargestChunk)
    throw std::runtime_error("found a chunk of " + std::to_string(expected_size) + " bytes, expected at most " +
                             std::to_string(kLargestChunk));
  std::string out;
  if (compression.empty()) {
    out = bytes;
  } else if (compression == "zstd") {
    // The size is the file's claim: what these bytes cannot hold is not allocated.
    if (expected_size > kLargestRatio * bytes.size())
      throw std::runtime_error("found a chunk of " + std::to_string(expected_size) + " bytes in " +
                               std::to_string(bytes.size()) + " compressed ones, expected at most " +
                               std::to_string(kLargestRatio * bytes.size()));
    out.resize(expected_size);
    const std::size_t size = ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size());
    checkZstd(size);
    out.resize(size);
  } else {
    throw std::runtime_error("found compression '" + std::string(compression) + "', expected zstd or none");
  }
  if (out.size() != expected_size)
    throw std::runtime_error("found " + std::to_string(out.size()) + " bytes in a chunk, expected " +
                             std::to_string(expected_size));
  return out;
}

}  // namespace tandem::recording
