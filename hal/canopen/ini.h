// SPDX-License-Identifier: Apache-2.0
/** @file INI files as the tools of many vendors write them: what is odd becomes a warning, and reading goes on. */
#pragma once

#include <cstddef>
#include <istream>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::hal::canopen {

/** A file that cannot be read at all. what(): "FILE:LINE: reason". */
class IniError : public std::runtime_error {
 public:
  IniError(const std::string& file, std::size_t line, const std::string& reason);
};

/** Something odd in a file, and how it was read. */
struct FileWarning {
  std::size_t line = 0;
  std::string text;
};

struct IniValue {
  std::string key;  ///< as the file spells it
  std::string text;
  std::size_t line = 0;
};

struct IniSection {
  std::string name;  ///< as the file spells it
  std::size_t line = 0;
  std::map<std::string, IniValue> values;  ///< by key in small letters

  /// nullptr: no such key, or no value. @param key  in small letters
  const IniValue* find(const std::string& key) const;
};

/** Sections and their values. Of a key or a section that comes twice the first one counts. Texts are UTF-8. */
class Ini {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{8} << 20;

  /** Reads all of `in` and appends to `warnings`.
   * @throw IniError for a file that is larger than kMostBytes, UTF-16 text, or has no section. */
  Ini(std::istream& in, const std::string& file, std::vector<FileWarning>& warnings);

  /// nullptr: no such section. @param name  in small letters
  const IniSection* find(const std::string& name) const;
  const std::map<std::string, IniSection>& sections() const { return sections_; }  ///< by name in small letters

 private:
  std::string clean(std::string_view line, std::size_t number);
  void read(std::string_view line, std::size_t number);
  void open(const std::string& line, std::size_t number);
  void put(const std::string& line, std::size_t number);
  void warn(std::size_t line, const std::string& text) { warnings_.push_back({line, text}); }
  /// A warning that would otherwise repeat in each line.
  void warnOnce(std::size_t line, const std::string& text);

  std::vector<FileWarning>& warnings_;
  std::map<std::string, IniSection> sections_;
  IniSection* section_ = nullptr;  ///< the one that is being read
  std::set<std::string> warned_;
};

/// A to Z in small letters.
std::string lowerCase(std::string text);
/// Without blanks at both ends.
std::string trimmed(std::string_view text);

}  // namespace tandem::hal::canopen
