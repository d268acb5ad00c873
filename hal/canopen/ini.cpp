// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/ini.h"

#include <algorithm>
#include <array>
#include <utility>

namespace tandem::hal::canopen {
namespace {

constexpr std::string_view kBlanks = " \t\r";
constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";

/// Bytes of the UTF-8 character at the begin of `text`; 0: there is none (RFC 3629).
std::size_t characterLength(std::string_view text) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
  const unsigned first = byte(0);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : (first & 0xF0) == 0xE0        ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0) != 0x80)
      return 0;
  }
  const bool excluded = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) >= 0xA0) ||
                        (first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) >= 0x90);
  return excluded ? 0 : length;
}

bool isUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = characterLength(text);
    if (length == 0)
      return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string fromLatin1(std::string_view text) {
  std::string utf8;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      utf8 += c;
    } else {
      utf8 += static_cast<char>(0xC0 | byte >> 6);
      utf8 += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  return utf8;
}

std::string readAll(std::istream& in, const std::string& file) {
  std::string text;
  std::array<char, 65536> block;
  while (text.size() <= Ini::kMostBytes && (in.read(block.data(), block.size()), in.gcount() > 0))
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
  if (text.size() > Ini::kMostBytes)
    throw IniError(file, 1, "more than " + std::to_string(Ini::kMostBytes >> 20) + " MiB, expected a data sheet");
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    throw IniError(file, 1, "found UTF-16 text, expected ASCII or UTF-8: save the file as UTF-8");
  return text;
}

}  // namespace

IniError::IniError(const std::string& file, std::size_t line, const std::string& reason)
    : std::runtime_error(file + ":" + std::to_string(line) + ": " + reason) {}

std::string lowerCase(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text;
}

std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos)
    return {};
  return std::string(text.substr(first, text.find_last_not_of(kBlanks) - first + 1));
}

const IniValue* IniSection::find(const std::string& key) const {
  const auto found = values.find(key);
  return found == values.end() || found->second.text.empty() ? nullptr : &found->second;
}

Ini::Ini(std::istream& in, const std::string& file, std::vector<FileWarning>& warnings) : warnings_(warnings) {
  const std::string all = readAll(in, file);
  std::string_view rest = all;
  if (rest.starts_with(kUtf8Mark)) {
    warn(1, "the file begins with a byte order mark, which is left out");
    rest.remove_prefix(kUtf8Mark.size());
  }
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
    read(rest.substr(0, end), number);
    rest.remove_prefix(std::min(end + (rest.substr(end).starts_with("\r\n") ? 2 : 1), rest.size()));
  }
  if (sections_.empty())
    throw IniError(file, 1, "found no [section], expected an EDS or DCF file (CiA 306)");
}

const IniSection* Ini::find(const std::string& name) const {
  const auto found = sections_.find(name);
  return found == sections_.end() ? nullptr : &found->second;
}

void Ini::warnOnce(std::size_t line, const std::string& text) {
  if (warned_.insert(text).second)
    warn(line, text);
}

std::string Ini::clean(std::string_view line, std::size_t number) {
  std::string text;
  for (const char c : line) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 || c == '\t') {
      text += c;
    } else if (c == '\0') {
      warnOnce(number, "NUL bytes are left out, here and in later lines");
    } else if (byte == 0x1A) {
      warnOnce(number, "control Z, the end of a file of DOS, is left out");
    } else {
      warnOnce(number, "control characters count as blanks, here and in later lines");
      text += ' ';
    }
  }
  if (!isUtf8(text)) {
    warnOnce(number, "bytes that are not UTF-8 are read as Latin-1, here and in later lines");
    text = fromLatin1(text);
  }
  return trimmed(text);
}

void Ini::read(std::string_view line, std::size_t number) {
  const std::string text = clean(line, number);
  if (text.empty() || text[0] == ';')
    return;
  if (text[0] == '[') {
    open(text, number);
  } else if (section_ == nullptr) {
    warnOnce(number, "text before the first [section] is left out");
  } else {
    put(text, number);
  }
}

void Ini::open(const std::string& line, std::size_t number) {
  const std::size_t end = std::min(line.find(']'), line.size());
  const std::string name = trimmed(line.substr(1, end - 1));
  const std::string after = end < line.size() ? trimmed(line.substr(end + 1)) : "";
  if (end == line.size())
    warn(number, "expected ']' at the end of a section's name, read as [" + name + "]");
  if (!after.empty() && after[0] != ';')
    warn(number, "[" + name + "]: found '" + after + "' after the name of the section, which is left out");
  const auto [place, fresh] = sections_.try_emplace(lowerCase(name), IniSection{name, number, {}});
  if (!fresh)
    warn(number, "section [" + name + "] is already defined in line " + std::to_string(place->second.line) +
                     ": of keys that both have, the first counts");
  section_ = &place->second;
}

void Ini::put(const std::string& line, std::size_t number) {
  const std::size_t equal = line.find('=');
  if (equal == std::string::npos || equal == 0) {
    warn(number, "expected KEY=VALUE, found '" + line + "', which is left out");
    return;
  }
  const std::string key = trimmed(line.substr(0, equal));
  const IniValue value{key, trimmed(line.substr(equal + 1)), number};
  const auto [place, fresh] = section_->values.try_emplace(lowerCase(key), value);
  if (!fresh)
    warn(number, "'" + key + "' is in this section already, in line " + std::to_string(place->second.line) +
                     ": the first one counts");
}

}  // namespace tandem::hal::canopen
