// SPDX-License-Identifier: Apache-2.0
#include "recording/definition.h"

#include <algorithm>
#include <charconv>
#include <sstream>

#include "recording/records.h"

namespace tandem::recording {
namespace {

const std::map<std::string, Kind>& basicTypes() {
  using enum Kind;
  static const std::map<std::string, Kind> types{
      {"bool", kBool},     {"byte", kUint8},      {"char", kUint8},      {"int8", kInt8},     {"uint8", kUint8},
      {"int16", kInt16},   {"uint16", kUint16},   {"int32", kInt32},     {"uint32", kUint32}, {"int64", kInt64},
      {"uint64", kUint64}, {"float32", kFloat32}, {"float64", kFloat64}, {"string", kString}};
  return types;
}

/// "package/msg/Type" and "package/Type" -> "package/Type"; "Type" in a message of package p -> "p/Type".
std::string key(const std::string& type, const std::string& package) {
  const auto first = type.find('/');
  return first == std::string::npos ? package + "/" + type : type.substr(0, first) + type.substr(type.rfind('/'));
}

/// Length of a fixed array. @throw std::out_of_range
std::size_t lengthOf(const std::string& digits) {
  std::size_t length = 0;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), length);
  if (status != std::errc() || length == 0 || length > kMostValues)
    throw std::out_of_range("found an array of " + digits.substr(0, 40) + " elements, expected 1 to " +
                            std::to_string(kMostValues));
  return length;
}

/// Reads one line. @return whether it is a member, not a constant or an empty line.
/// @throw std::out_of_range for an array without elements or with too many
bool readField(std::string line, const std::string& package, Field& field) {
  const auto comment = line.find('#');
  field.comment = comment == std::string::npos ? "" : line.substr(comment + 1);
  line = line.substr(0, comment);
  std::istringstream words(line);
  std::string type;
  if (!(words >> type >> field.name))
    return false;
  std::string rest;
  std::getline(words, rest);
  const auto text = rest.find_first_not_of(" \t");
  if (field.name.find('=') != std::string::npos || (text != std::string::npos && rest[text] == '='))
    return false;  // a constant
  if (const auto bracket = type.find('['); bracket != std::string::npos) {
    const std::string inside = type.substr(bracket + 1, type.size() - bracket - 2);
    const bool fixed = !inside.empty() && inside.find_first_not_of("0123456789") == std::string::npos;
    field.count = fixed ? Field::Count::kFixed : Field::Count::kSequence;
    field.length = fixed ? lengthOf(inside) : 0;
    type.resize(bracket);
  }
  type = type.substr(0, type.find("<="));  // bounds do not change the layout
  const auto basic = basicTypes().find(type);
  field.kind = basic == basicTypes().end() ? Kind::kMessage : basic->second;
  field.type = field.kind == Kind::kMessage ? key(type, package) : "";
  return true;
}

/** Refuses what has no bounded size: reading then needs no bounds of its own. */
class SizeCheck {
 public:
  explicit SizeCheck(const Definition& definition) : types_(definition.types) {}

  struct Size {
    std::size_t values = 0;
    int levels = 0;
  };
  /// Size of a type whose sequences have one element each. @throw std::out_of_range
  Size of(const std::string& type) {
    const auto [place, is_new] = sizes_.try_emplace(type, Size{0, -1});
    if (!is_new && place->second.levels < 0)
      throw std::out_of_range("type " + type + " contains itself");
    if (!is_new)
      return place->second;
    Size size;
    for (const Field& field : types_.at(type)) {
      const Size element = field.kind == Kind::kMessage ? of(field.type) : Size{1, 0};
      if (element.values == 0 && field.count != Field::Count::kOne)
        throw std::out_of_range("member " + field.name + " is an array of " + field.type + ", which has no members");
      size.values += element.values * (field.count == Field::Count::kFixed ? field.length : 1);
      size.levels = std::max(size.levels, element.levels + 1);
      if (size.values > kMostValues || size.levels > kDeepest)
        throw std::out_of_range("type " + type + " has more than " + std::to_string(kMostValues) + " values or " +
                                std::to_string(kDeepest) + " levels of nested types");
    }
    return sizes_[type] = size;
  }

 private:
  const std::map<std::string, std::vector<Field>>& types_;
  std::map<std::string, Size> sizes_;  ///< levels -1: being computed
};

}  // namespace

Definition parseDefinition(const std::string& type, const std::string& text) {
  Definition definition;
  definition.root = key(type, "");
  std::string current = definition.root;
  definition.types[current];
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("===")) {
      if (!std::getline(lines, line) || !line.starts_with("MSG: "))
        throw Error("definition of " + type + ": found '" + line + "' below a line of =, expected MSG: and a type");
      current = key(line.substr(5, line.find_last_not_of(" \t\r") - 4), "");
      definition.types[current];
      continue;
    }
    try {
      Field field;
      if (!readField(line, current.substr(0, current.find('/')), field))
        continue;
      std::vector<Field>& fields = definition.types[current];
      if (std::ranges::find(fields, field.name, &Field::name) != fields.end())
        throw std::out_of_range("member " + field.name + " of " + current + " is there twice");
      fields.push_back(std::move(field));
    } catch (const std::out_of_range& error) {
      throw Error("definition of " + type + ": line '" + line.substr(0, 100) + "': " + error.what());
    }
  }
  for (const auto& [name, fields] : definition.types) {
    for (const Field& field : fields) {
      if (field.kind == Kind::kMessage && !definition.types.contains(field.type))
        throw Error("definition of " + type + ": member " + field.name + " of " + name + " is a " + field.type +
                    ", which is not defined");
    }
  }
  try {
    SizeCheck check(definition);
    for (const auto& [name, fields] : definition.types)
      check.of(name);
  } catch (const std::out_of_range& error) {
    throw Error("definition of " + type + ": " + error.what());
  }
  return definition;
}

}  // namespace tandem::recording
