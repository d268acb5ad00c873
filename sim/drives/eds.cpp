// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/eds.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "hal/canopen/cob.h"
#include "sim/drives/detail/builtin_eds.h"

namespace tandem::sim::drives {
namespace {

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string trim(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos)
    return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

struct Value {
  std::string text;
  std::size_t line = 0;
};

struct Section {
  std::string name;
  std::size_t line = 0;
  std::map<std::string, Value> values;  // keys in small letters
};

/** The file as an INI file. */
class Ini {
 public:
  Ini(std::istream& in, std::string file) : file_(std::move(file)) {
    std::string line;
    Section* section = nullptr;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
      line = trim(line);
      if (line.empty() || line[0] == ';')
        continue;
      if (line[0] == '[') {
        section = &open(line, number);
      } else if (section == nullptr) {
        throw EdsError(file_, number, "expected a [section] first");
      } else {
        put(*section, line, number);
      }
    }
  }

  const Section* find(const std::string& name) const {
    const auto found = sections_.find(lower(name));
    return found == sections_.end() ? nullptr : &found->second;
  }
  const Section& require(const std::string& name, std::size_t line) const {
    const Section* section = find(name);
    if (section == nullptr)
      throw EdsError(file_, line, "expected a section [" + name + "]");
    return *section;
  }
  const Value* value(const Section& section, const std::string& key) const {
    const auto found = section.values.find(lower(key));
    return found == section.values.end() || found->second.text.empty() ? nullptr : &found->second;
  }
  const Value& require(const Section& section, const std::string& key) const {
    const Value* found = value(section, key);
    if (found == nullptr)
      throw EdsError(file_, section.line, "[" + section.name + "]: expected " + key);
    return *found;
  }
  std::int64_t number(const Value& value) const { return number(value.text, value.line); }
  /// @param bits  whether numbers from 2^63 to 2^64 - 1 stand for their bits, as in a 64-bit object
  std::int64_t number(const std::string& text, std::size_t line, bool bits = false) const {
    const bool negative = text.starts_with('-');
    std::string digits = text.substr(negative ? 1 : 0);
    int base = 10;
    if (digits.starts_with("0x") || digits.starts_with("0X")) {
      base = 16;
      digits = digits.substr(2);
    }
    std::uint64_t magnitude = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), magnitude, base);
    if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size())
      throw EdsError(file_, line, "expected a number, found '" + text + "'");
    constexpr std::uint64_t kLargest = std::numeric_limits<std::int64_t>::max();
    if (magnitude > (negative ? kLargest + 1 : bits ? ~std::uint64_t{0} : kLargest))
      throw EdsError(file_, line, "expected a number of 64 bits, found '" + text + "'");
    return static_cast<std::int64_t>(negative ? 0 - magnitude : magnitude);
  }
  const std::map<std::string, Section>& sections() const { return sections_; }
  const std::string& file() const { return file_; }

 private:
  Section& open(const std::string& line, std::size_t number) {
    if (!line.ends_with(']'))
      throw EdsError(file_, number, "expected ']' at the end of a section's name");
    const std::string name = trim(line.substr(1, line.size() - 2));
    const auto [place, fresh] = sections_.try_emplace(lower(name), Section{name, number, {}});
    if (!fresh) {
      throw EdsError(file_, number,
                     "section [" + name + "] is already defined in line " + std::to_string(place->second.line));
    }
    return place->second;
  }
  void put(Section& section, const std::string& line, std::size_t number) {
    const std::size_t equal = line.find('=');
    if (equal == std::string::npos || equal == 0)
      throw EdsError(file_, number, "expected KEY=VALUE, found '" + line + "'");
    const std::string key = trim(line.substr(0, equal));
    if (!section.values.try_emplace(lower(key), Value{trim(line.substr(equal + 1)), number}).second)
      throw EdsError(file_, number, "'" + key + "' is in this section already");
  }

  std::string file_;
  std::map<std::string, Section> sections_;
};

struct Range {
  std::int64_t low;
  std::int64_t high;
};

Range rangeOf(DataType type) {
  const int bits = 8 * sizeOf(type);
  if (type == DataType::kBoolean)
    return {0, 1};
  if (bits == 64)
    return {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()};
  if (isSigned(type))
    return {-(std::int64_t{1} << (bits - 1)), (std::int64_t{1} << (bits - 1)) - 1};
  return {0, (std::int64_t{1} << bits) - 1};
}

/** Turns sections into objects. */
class Reader {
 public:
  explicit Reader(const Ini& ini) : ini_(ini) {}

  Eds read() {
    Eds eds;
    eds.file = ini_.file();
    const Section& device = ini_.require("DeviceInfo", 1);
    if (const Value* product = ini_.value(device, "ProductName"))
      eds.product = product->text;
    for (const char* list : {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"})
      readList(list, eds);
    for (const auto& [name, section] : ini_.sections()) {
      if (looksLikeObject(name) && !listed_.contains(static_cast<std::uint16_t>(std::stoul(name.substr(0, 4), {}, 16))))
        throw EdsError(ini_.file(), section.line, "[" + section.name + "] is in none of the lists of objects");
    }
    std::ranges::sort(eds.objects, {}, &EdsObject::address);
    return eds;
  }

 private:
  static bool looksLikeObject(const std::string& name) {
    const auto hex = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
    return name.size() >= 4 && std::all_of(name.begin(), name.begin() + 4, hex) &&
           (name.size() == 4 || name.compare(4, 3, "sub") == 0);
  }

  void readList(const std::string& name, Eds& eds) {
    const Section* list = ini_.find(name);
    if (list == nullptr)
      return;
    const std::int64_t count = ini_.number(ini_.require(*list, "SupportedObjects"));
    if (count != static_cast<std::int64_t>(list->values.size()) - 1) {
      throw EdsError(ini_.file(), list->line,
                     "[" + name + "]: SupportedObjects: found " + std::to_string(count) + ", expected " +
                         std::to_string(list->values.size() - 1) + ", the number of entries in this section");
    }
    for (std::int64_t k = 1; k <= count; ++k) {
      const Value& entry = ini_.require(*list, std::to_string(k));
      const std::int64_t index = ini_.number(entry);
      if (index < 0x1000 || index > 0xFFFF)
        throw EdsError(ini_.file(), entry.line, "expected an index from 0x1000 to 0xFFFF");
      if (!listed_.insert(static_cast<std::uint16_t>(index)).second)
        throw EdsError(ini_.file(), entry.line, "object " + entry.text + " is listed twice");
      readIndex(static_cast<std::uint16_t>(index), entry.line, eds);
    }
  }

  void readIndex(std::uint16_t index, std::size_t line, Eds& eds) {
    char name[8];
    std::snprintf(name, sizeof name, "%04X", index);
    const Section& section = ini_.require(name, line);
    const Value* kind = ini_.value(section, "ObjectType");
    const std::int64_t type = kind == nullptr ? 7 : ini_.number(*kind);
    if (type == 7) {
      eds.objects.push_back(readObject(section, {index, 0}));
      return;
    }
    if (type != 8 && type != 9)
      throw EdsError(ini_.file(), kind->line,
                     "ObjectType: found " + kind->text + ", expected 0x7 (VAR), 0x8 (ARRAY) or 0x9 (RECORD)");
    const Value& count = ini_.require(section, "SubNumber");
    std::int64_t found = 0;
    for (int sub = 0; sub <= 0xFE; ++sub) {
      std::snprintf(name, sizeof name, "%X", sub);
      if (const Section* part = ini_.find(section.name + "sub" + name)) {
        eds.objects.push_back(readObject(*part, {index, static_cast<std::uint8_t>(sub)}));
        ++found;
      }
    }
    if (found != ini_.number(count)) {
      throw EdsError(ini_.file(), count.line,
                     "SubNumber: found " + count.text + ", expected " + std::to_string(found) +
                         ", the number of sections [" + section.name + "subN]");
    }
  }

  EdsObject readObject(const Section& section, ObjectAddress address) {
    EdsObject object;
    object.address = address;
    object.line = section.line;
    object.name = ini_.require(section, "ParameterName").text;
    object.type = readType(section);
    object.access = readAccess(section);
    if (const Value* mapping = ini_.value(section, "PDOMapping"))
      object.mappable = ini_.number(*mapping) != 0;
    const Value* value = ini_.value(section, "DefaultValue");
    if (sizeOf(object.type) == 0) {
      object.text = value == nullptr ? "" : value->text;
      return object;
    }
    object.low = readNumber(section, "LowLimit", object.type);
    object.high = readNumber(section, "HighLimit", object.type);
    if (value != nullptr)
      readDefault(*value, object);
    if ((object.low && object.value < *object.low) || (object.high && object.value > *object.high))
      throw EdsError(ini_.file(), section.line,
                     "[" + section.name + "]: DefaultValue: found " + std::to_string(object.value) + ", expected " +
                         (object.low ? "LowLimit " + std::to_string(*object.low) : "any") + " to " +
                         (object.high ? "HighLimit " + std::to_string(*object.high) : "any"));
    return object;
  }

  std::optional<std::int64_t> readNumber(const Section& section, const char* key, DataType type) const {
    const Value* value = ini_.value(section, key);
    if (value == nullptr)
      return std::nullopt;
    return fit(value->text, type, value->line);
  }

  void readDefault(const Value& value, EdsObject& object) const {
    const std::string text = lower(value.text);
    const std::size_t plus = text.find('+');
    if (!text.starts_with("$nodeid")) {
      object.value = fit(value.text, object.type, value.line);
      return;
    }
    object.adds_node_id = true;
    object.value = plus == std::string::npos ? 0 : fit(trim(text.substr(plus + 1)), object.type, value.line);
    const std::int64_t most = rangeOf(object.type).high - hal::canopen::kMaxNodeId;
    if (object.value > most)
      throw EdsError(ini_.file(), value.line,
                     "DefaultValue: found " + value.text + ", expected at most " + std::to_string(most) +
                         ", so that every node id fits the data type");
  }

  std::int64_t fit(const std::string& text, DataType type, std::size_t line) const {
    const std::int64_t value = ini_.number(text, line, sizeOf(type) == 8);
    const Range range = rangeOf(type);
    // Negative numbers may be written as their two's complement: 0xFF for an INTEGER8.
    if (isSigned(type) && sizeOf(type) < 8 && value > range.high && value <= 2 * range.high + 1)
      return value - 2 * (range.high + 1);
    if (value < range.low || value > range.high)
      throw EdsError(ini_.file(), line, std::to_string(value) + " does not fit the data type");
    return value;
  }

  DataType readType(const Section& section) const {
    const Value& value = ini_.require(section, "DataType");
    const std::int64_t type = ini_.number(value);
    constexpr std::int64_t kKnown[] = {1, 2, 3, 4, 5, 6, 7, 9, 0x15, 0x1B};
    if (std::ranges::find(kKnown, type) == std::end(kKnown))
      throw EdsError(ini_.file(), value.line, "data type " + value.text + " is not supported");
    return static_cast<DataType>(type);
  }

  Access readAccess(const Section& section) const {
    const Value& value = ini_.require(section, "AccessType");
    const std::string text = lower(value.text);
    if (text == "ro")
      return Access::kReadOnly;
    if (text == "wo")
      return Access::kWriteOnly;
    if (text == "const")
      return Access::kConstant;
    if (text == "rw" || text == "rwr" || text == "rww")
      return Access::kReadWrite;
    throw EdsError(ini_.file(), value.line, "expected ro, wo, rw, rwr, rww or const, found '" + value.text + "'");
  }

  const Ini& ini_;
  std::set<std::uint16_t> listed_;
};

Eds builtIn(std::string_view text, const std::string& name) {
  std::istringstream in{std::string(text)};
  return parseEds(in, name);
}

}  // namespace

EdsError::EdsError(const std::string& file, std::size_t line, const std::string& reason)
    : std::runtime_error(file + ":" + std::to_string(line) + ": " + reason) {}

int sizeOf(DataType type) {
  switch (type) {
    case DataType::kBoolean:
    case DataType::kInteger8:
    case DataType::kUnsigned8:
      return 1;
    case DataType::kInteger16:
    case DataType::kUnsigned16:
      return 2;
    case DataType::kInteger32:
    case DataType::kUnsigned32:
      return 4;
    case DataType::kInteger64:
    case DataType::kUnsigned64:
      return 8;
    case DataType::kVisibleString:
      break;
  }
  return 0;
}

bool isSigned(DataType type) {
  return type == DataType::kInteger8 || type == DataType::kInteger16 || type == DataType::kInteger32 ||
         type == DataType::kInteger64;
}

Eds parseEds(std::istream& in, const std::string& file) {
  const Ini ini(in, file);
  return Reader(ini).read();
}

Eds loadEds(const std::string& path) {
  std::ifstream in(path);
  if (!in)
    throw std::runtime_error(path + ": cannot be opened");
  return parseEds(in, path);
}

Eds completed(Eds eds, const Eds& own) {
  std::vector<EdsObject> hidden = own.objects, all;
  for (EdsObject& object : hidden)
    object.hidden = true;
  std::ranges::set_union(eds.objects, hidden, std::back_inserter(all), {}, &EdsObject::address, &EdsObject::address);
  eds.objects = std::move(all);
  return eds;
}

const Eds& driveEds() {
  static const Eds eds = builtIn(kDriveEds, "tandem-drive.eds");
  return eds;
}

const Eds& encoderEds() {
  static const Eds eds = builtIn(kEncoderEds, "tandem-encoder.eds");
  return eds;
}

}  // namespace tandem::sim::drives
