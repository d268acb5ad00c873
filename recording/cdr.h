// SPDX-License-Identifier: Apache-2.0
/** @file Plain CDR, version 1, with its encapsulation header. */
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "recording/definition.h"

namespace tandem::recording {

/// Bytes of a value; 1 for texts and messages.
inline std::size_t sizeOf(Kind kind) {
  switch (kind) {
    case Kind::kInt16:
    case Kind::kUint16:
      return 2;
    case Kind::kInt32:
    case Kind::kUint32:
    case Kind::kFloat32:
      return 4;
    case Kind::kInt64:
    case Kind::kUint64:
    case Kind::kFloat64:
      return 8;
    default:
      return 1;
  }
}

/** Reader of both byte orders. A read beyond the end returns 0 or an empty text, and good() becomes false. */
class Cdr {
 public:
  explicit Cdr(std::string_view bytes) : bytes_(bytes) {
    good_ = bytes.size() >= 4 && bytes[0] == 0 && (bytes[1] == 0 || bytes[1] == 1);
    swap_ = good_ && bytes[1] == 0;
  }

  template <class T>
  T number() {
    std::array<char, sizeof(T)> raw{};
    at_ += (sizeof(T) - at_ % sizeof(T)) % sizeof(T);
    const std::string_view from = take(sizeof(T));
    std::copy(from.begin(), from.end(), raw.begin());
    if (swap_)
      std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();  // with the zero at the end
    const std::string_view text = take(size);
    return std::string(text.substr(0, text.empty() ? 0 : text.size() - 1));
  }
  /// Number of elements of a sequence. @param smallest  least size of an element, bytes
  std::size_t count(std::size_t smallest) {
    const auto size = number<std::uint32_t>();
    if (size > (bytes_.size() - std::min(bytes_.size(), 4 + at_)) / std::max<std::size_t>(1, smallest))
      good_ = false;
    return good_ ? size : 0;
  }
  bool good() const { return good_; }
  bool atEnd() const { return bytes_.size() - std::min(bytes_.size(), 4 + at_) < 4; }  // encoders may pad to 4

 private:
  std::string_view take(std::size_t size) {
    if (!good_ || 4 + at_ + size > bytes_.size()) {
      good_ = false;
      return {};
    }
    const std::string_view taken = bytes_.substr(4 + at_, size);
    at_ += size;
    return taken;
  }

  std::string_view bytes_;
  std::size_t at_ = 0;  // bytes after the encapsulation header
  bool good_, swap_;
};

/** Writer, little-endian. */
class CdrSink {
 public:
  /// The low `size` bytes of a number.
  void number(std::uint64_t bits, std::size_t size) {
    bytes_.resize(4 + (bytes_.size() - 4 + size - 1) / size * size, '\0');
    bytes_.append(reinterpret_cast<const char*>(&bits), size);
  }
  void text(std::string_view text) {
    number(text.size() + 1, 4);  // with the zero at the end
    bytes_.append(text).push_back('\0');
  }
  std::size_t size() const { return bytes_.size(); }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_{"\0\1\0\0", 4};
};

}  // namespace tandem::recording
