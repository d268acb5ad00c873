// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the fuzz targets. Each FILE.cpp beside this is one target: LLVMFuzzerTestOneInput() takes
 * any bytes, gives them to a parser and checks properties of what it returns. docs/development.md describes how to run
 * them. */
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

// libFuzzer calls it by this name. NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace tandem::fuzz {

/// Aborts with `property` and `found` unless it holds.
inline void expect(bool holds, const char* property, const std::string& found = {}) {
  if (holds)
    return;
  std::fprintf(stderr, "property does not hold: %s\nfound: %s\n", property, found.c_str());
  std::abort();
}

inline std::string_view textOf(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/** Takes numbers from the front of an input; an input that is too short ends in zeros. */
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : bytes_(textOf(data, size)) {}

  template <class T>
  T number() {
    T value{};
    const std::size_t size = std::min(sizeof value, bytes_.size());
    std::memcpy(&value, bytes_.data(), size);
    bytes_.remove_prefix(size);
    return value;
  }
  /// The text up to a separator, which is removed as well.
  std::string_view upTo(char separator) {
    const std::size_t end = std::min(bytes_.find(separator), bytes_.size());
    const std::string_view front = bytes_.substr(0, end);
    bytes_.remove_prefix(std::min(end + 1, bytes_.size()));
    return front;
  }
  bool empty() const { return bytes_.empty(); }
  std::string_view rest() const { return bytes_; }

 private:
  std::string_view bytes_;
};

/** A file in memory, for parsers that take the path of a file. */
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    expect(descriptor_ >= 0 && write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
           "a file in memory has been written");
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/** An empty folder, removed with the object. */
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-fuzz-XXXXXX").string();
    expect(mkdtemp(name.data()) != nullptr, "there is a folder for temporary files");
    path_ = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// An error must begin with "FILE:LINE:", with a line inside the text.
inline void expectPlace(std::string_view error, const std::string& file, std::string_view text) {
  std::size_t lines = 1;
  for (const char c : text)
    lines += c == '\n';
  expect(error.starts_with(file + ":"), "an error names its file", std::string(error));
  const std::size_t line = std::strtoul(std::string(error.substr(file.size() + 1)).c_str(), nullptr, 10);
  expect(line >= 1 && line <= lines, "an error names a line of its file", std::string(error));
}

}  // namespace tandem::fuzz
