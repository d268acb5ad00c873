// SPDX-License-Identifier: Apache-2.0
/** @file Bounds-checked little-endian byte reader and writer for MCAP records. */
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace tandem::recording {

static_assert(std::endian::native == std::endian::little, "MCAP is little-endian, and so are the hosts");

/** Appends to a string that is used as a byte buffer. */
class ByteSink {
 public:
  explicit ByteSink(std::string& bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_integral_v<T> ByteSink& number(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  ByteSink& raw(std::string_view bytes) {
    bytes_.append(bytes);
    return *this;
  }
  /// Length (u32) and bytes.
  ByteSink& text(std::string_view text) { return number(static_cast<std::uint32_t>(text.size())).raw(text); }
  /// Length in bytes (u32), then keys and values.
  ByteSink& map(const std::map<std::string, std::string>& values) {
    std::string entries;
    ByteSink sink(entries);
    for (const auto& [key, value] : values)
      sink.text(key).text(value);
    return text(entries);
  }

 private:
  std::string& bytes_;
};

/** Reads from the front of bytes that it does not own. @throw std::out_of_range if there are too few. */
class ByteSource {
 public:
  explicit ByteSource(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T number() {
    T value;
    std::memcpy(&value, raw(sizeof value).data(), sizeof value);
    return value;
  }
  std::string_view raw(std::uint64_t size) {
    if (size > bytes_.size())
      throw std::out_of_range("found " + std::to_string(bytes_.size()) + " bytes, expected " + std::to_string(size));
    const std::string_view front = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return front;
  }
  std::string_view text() { return raw(number<std::uint32_t>()); }
  std::map<std::string, std::string> map() {
    ByteSource entries(text());
    std::map<std::string, std::string> values;
    while (!entries.empty()) {
      std::string key(entries.text());
      values[std::move(key)] = entries.text();
    }
    return values;
  }
  bool empty() const { return bytes_.empty(); }
  std::string_view rest() const { return bytes_; }

 private:
  std::string_view bytes_;
};

}  // namespace tandem::recording
