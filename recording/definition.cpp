// SPDX-License-Identifier: Apache-2.0
#include "recording/definition.h"

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

/// Reads one line without its comment. @return whether it is a member, not a constant or an empty line.
bool readField(std::string line, const std::string& package, Field& field) {
  line = line.substr(0, line.find('#'));
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
    field.length = fixed ? std::stoul(inside) : 0;
    type.resize(bracket);
  }
  type = type.substr(0, type.find("<="));  // bounds do not change the layout
  const auto basic = basicTypes().find(type);
  field.kind = basic == basicTypes().end() ? Kind::kMessage : basic->second;
  field.type = field.kind == Kind::kMessage ? key(type, package) : "";
  return true;
}

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
    Field field;
    if (readField(line, current.substr(0, current.find('/')), field))
      definition.types[current].push_back(std::move(field));
  }
  for (const auto& [name, fields] : definition.types) {
    for (const Field& field : fields) {
      if (field.kind == Kind::kMessage && !definition.types.contains(field.type))
        throw Error("definition of " + type + ": member " + field.name + " of " + name + " is a " + field.type +
                    ", which is not defined");
    }
  }
  return definition;
}

}  // namespace tandem::recording
