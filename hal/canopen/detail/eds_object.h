// SPDX-License-Identifier: Apache-2.0
/** @file One object of a data sheet: type, access, limits, value. */
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hal/canopen/detail/eds_number.h"
#include "hal/canopen/eds.h"

namespace tandem::hal::canopen {

/// Hexadecimal digits and nothing else; nullopt: other characters, or more than 8 digits.
std::optional<std::uint32_t> hexNumber(const std::string& text);

/** Reads objects from their sections. What cannot be read gets a warning, and a value that promises least. */
class EdsObjectReader {
 public:
  explicit EdsObjectReader(std::vector<FileWarning>& warnings) : warnings_(warnings) {}

  EdsObject read(const IniSection& section, ObjectAddress address);
  /// The value of an object, whose type is known.
  void readValue(const IniValue& value, EdsObject& object);

  /// A non-negative number; nullopt, with a warning: it is none, or too large.
  template <class T>
  std::optional<T> number(const IniValue& value, const std::string& key) {
    const auto found = read(value, key);
    if (!found)
      return std::nullopt;
    if (found->negative || found->adds_node_id || found->magnitude > std::numeric_limits<T>::max()) {
      warn(value, key, "expected a number up to " + std::to_string(std::numeric_limits<T>::max()));
      return std::nullopt;
    }
    return static_cast<T>(found->magnitude);
  }
  /// ... of a key; nullopt without warning: the section does not have it.
  template <class T>
  std::optional<T> number(const IniSection& section, const std::string& key) {
    const IniValue* value = section.find(key);
    return value == nullptr ? std::nullopt : number<T>(*value, "[" + section.name + "]: " + value->key);
  }

 private:
  void warn(std::size_t line, const std::string& text) { warnings_.push_back({line, text}); }
  void warn(const IniValue& value, const std::string& key, const std::string& expected);
  std::optional<EdsNumber> read(const IniValue& value, const std::string& key);
  void readType(const IniSection& section, EdsObject& object);
  void readAccess(const IniSection& section, EdsObject& object);
  std::optional<std::int64_t> readLimit(const IniSection& section, const char* key, DataType type);
  void checkValue(const IniSection& section, EdsObject& object);

  std::vector<FileWarning>& warnings_;
};

}  // namespace tandem::hal::canopen
