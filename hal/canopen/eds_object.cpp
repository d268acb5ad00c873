// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/detail/eds_object.h"

#include <algorithm>
#include <charconv>

#include "hal/canopen/cob.h"

namespace tandem::hal::canopen {
namespace {

std::string describeLimits(const EdsObject& object) {
  return (object.low ? std::to_string(*object.low) : "any") + " to " +
         (object.high ? std::to_string(*object.high) : "any");
}

bool outside(std::int64_t value, const EdsObject& object) {
  return (object.low && value < *object.low) || (object.high && value > *object.high);
}

}  // namespace

std::optional<std::uint32_t> hexNumber(const std::string& text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size())
    return std::nullopt;
  return value;
}

void EdsObjectReader::warn(const IniValue& value, const std::string& key, const std::string& expected) {
  warn(value.line, key + ": found '" + value.text + "', " + expected);
}

std::optional<EdsNumber> EdsObjectReader::read(const IniValue& value, const std::string& key) {
  auto number = readNumber(value.text);
  if (!number) {
    warn(value, key, "expected a number");
    return std::nullopt;
  }
  for (const std::string& odd : number->odd)
    warn(value.line, key + ": " + odd);
  return number;
}

EdsObject EdsObjectReader::read(const IniSection& section, ObjectAddress address) {
  EdsObject object;
  object.address = address;
  object.line = section.line;
  if (const IniValue* name = section.find("parametername")) {
    object.name = name->text;
  } else {
    warn(section.line, "[" + section.name + "]: expected ParameterName");
  }
  readType(section, object);
  readAccess(section, object);
  object.mappable = number<std::uint32_t>(section, "pdomapping").value_or(0) != 0;
  if (sizeOf(object.type) > 0 && !isReal(object.type)) {
    object.low = readLimit(section, "lowlimit", object.type);
    object.high = readLimit(section, "highlimit", object.type);
    if (object.low && object.high && *object.low > *object.high) {
      warn(section.line, "[" + section.name + "]: LowLimit is above HighLimit: both are left out");
      object.low = object.high = std::nullopt;
    }
  }
  // ParameterValue: what a DCF writes.
  const IniValue* value = section.find("parametervalue");
  if (value == nullptr)
    value = section.find("defaultvalue");
  if (value != nullptr)
    readValue(*value, object);
  checkValue(section, object);
  return object;
}

void EdsObjectReader::readType(const IniSection& section, EdsObject& object) {
  const bool given = section.find("datatype") != nullptr;
  const auto type = number<std::uint16_t>(section, "datatype");
  object.type = type ? static_cast<DataType>(*type) : DataType::kDomain;
  if (!name(object.type).empty() && type)
    return;
  object.type = DataType::kDomain;
  // An object of the kind DOMAIN needs no type.
  if (given || section.find("objecttype") == nullptr || number<std::uint32_t>(section, "objecttype") != 2)
    warn(given ? section.find("datatype")->line : section.line,
         "[" + section.name +
             "]: " + (given ? "data type " + section.find("datatype")->text + " is unknown" : "expected DataType") +
             ": read as DOMAIN, bytes without a type");
}

void EdsObjectReader::readAccess(const IniSection& section, EdsObject& object) {
  const IniValue* value = section.find("accesstype");
  std::vector<std::string> odd;
  const std::string text = value == nullptr ? "" : lowerCase(withoutComment(value->text, odd));
  for (const std::string& one : odd)
    warn(value->line, "[" + section.name + "]: AccessType: " + one);
  if (text == "const") {
    object.access = Access::kConstant;
  } else if (text == "wo") {
    object.access = Access::kWriteOnly;
  } else if (text == "rw" || text == "rwr" || text == "rww") {
    object.access = Access::kReadWrite;
  } else if (text != "ro") {
    const std::string expected = "expected AccessType ro, wo, rw, rwr, rww or const: read as ro";
    if (value == nullptr) {
      warn(section.line, "[" + section.name + "]: " + expected);
    } else {
      warn(*value, "[" + section.name + "]", expected);
    }
  }
}

std::optional<std::int64_t> EdsObjectReader::readLimit(const IniSection& section, const char* key, DataType type) {
  const IniValue* value = section.find(key);
  if (value == nullptr)
    return std::nullopt;
  const std::string what = "[" + section.name + "]: " + value->key;
  const auto number = read(*value, what);
  if (!number)
    return std::nullopt;
  const auto limit = number->adds_node_id ? std::nullopt : fit(*number, type);
  if (!limit)
    warn(*value, what, "which no " + std::string(name(type)) + " reaches: the limit is left out");
  // Limits of an UNSIGNED64 beyond those of an INTEGER64 do not restrict what 64 signed bits can hold.
  const bool beyond = limit && type == DataType::kUnsigned64 && *limit < 0;
  return beyond ? std::nullopt : limit;
}

void EdsObjectReader::readValue(const IniValue& value, EdsObject& object) {
  const std::string what = "value of " + describe(object.address);
  if (sizeOf(object.type) == 0) {
    object.text = value.text;
    object.has_value = true;
    return;
  }
  if (isReal(object.type)) {
    const auto bits = readReal(value.text, object.type);
    object.has_value = bits.has_value();
    object.value = bits.value_or(0);
    if (!bits)
      warn(value, what, "expected a " + std::string(name(object.type)) + ": the value is left out");
    return;
  }
  const auto number = read(value, what);
  if (!number)
    return;
  const auto fitted = fit(*number, object.type);
  const std::int64_t most = largest(object.type) - (number->adds_node_id ? kMaxNodeId : 0);
  if (!fitted || (number->adds_node_id && *fitted > most)) {
    warn(value, what, "which does not fit " + std::string(name(object.type)) + ": the value is left out");
    return;
  }
  object.value = *fitted;
  object.adds_node_id = number->adds_node_id;
  object.has_value = true;
}

void EdsObjectReader::checkValue(const IniSection& section, EdsObject& object) {
  if (object.has_value && !object.adds_node_id && outside(object.value, object)) {
    warn(section.line, "[" + section.name + "]: found the value " + std::to_string(object.value) +
                           " outside its limits, " + describeLimits(object));
  } else if (!object.has_value && outside(0, object)) {
    object.value = object.low && *object.low > 0 ? *object.low : *object.high;
    warn(section.line, "[" + section.name + "]: no DefaultValue, and 0 is outside the limits, " +
                           describeLimits(object) + ": a simulated device starts with " + std::to_string(object.value));
  }
}

}  // namespace tandem::hal::canopen
