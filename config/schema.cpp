// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "config/file_tables.h"
#include "config/robot_files.h"

namespace tandem::config {
namespace {

using Json = nlohmann::ordered_json;

/// Whole numbers as integers, others with 12 digits, as in a file.
Json plainNumber(double value) {
  if (value == std::round(value) && std::abs(value) < 1e15)
    return static_cast<long long>(value);
  return std::stod(formatNumber(value));
}

Json rangeOf(const Field& field, const Unit* unit, Json json) {
  const auto in_unit = [unit](double value) { return plainNumber(unit ? unit->fromSi(value) : value); };
  if (std::isfinite(field.range.minimum)) {
    json[field.range.exclusive_minimum ? "exclusiveMinimum" : "minimum"] = in_unit(field.range.minimum);
  }
  if (std::isfinite(field.range.maximum))
    json["maximum"] = in_unit(field.range.maximum);
  return json;
}

Json wordsOf(const Field& field) {
  Json words = Json::array();
  for (const std::string& word : field.words) {
    words.push_back(word);
    // An integer without quotes is accepted, too.
    if (field.numeric_text && word[0] >= '0' && word[0] <= '9')
      words.push_back(std::stoi(word));
  }
  return words;
}

Json textOf(const Field& field) {
  if (!field.words.empty())
    return {{"enum", wordsOf(field)}};
  Json json{{"type", field.numeric_text ? Json{"string", "integer"} : Json("string")}};
  if (field.pattern.empty()) {
    json["minLength"] = 1;
  } else {
    json["pattern"] = field.pattern;
  }
  return json;
}

Json withWords(const Field& field, Json json) {
  return field.words.empty() ? json : Json{{"anyOf", {json, Json{{"enum", wordsOf(field)}}}}};
}

Json elementOf(const Field& field, const Unit* unit) {
  switch (field.type) {
    case Type::kBool:
      return {{"type", "boolean"}};
    case Type::kInteger:
      return rangeOf(field, unit, {{"type", "integer"}});
    case Type::kNumber: {
      const Json scalar = withWords(field, rangeOf(field, unit, {{"type", "number"}}));
      if (field.row_size == 0)
        return scalar;
      return {{"type", "array"}, {"items", scalar}, {"minItems", field.row_size}, {"maxItems", field.row_size}};
    }
    case Type::kText:
      return textOf(field);
    case Type::kMapping:
      return withWords(field, {{"$ref", "#/$defs/" + field.mapping->name}});
  }
  return {};
}

/// Default in the unit of the key; null unless it is a single value.
Json defaultOf(const Field& field, const Unit* unit) {
  if (field.default_text)
    return *field.default_text;
  if (!field.default_number || std::isnan(*field.default_number))
    return nullptr;
  if (field.type == Type::kBool)
    return *field.default_number != 0.0;
  if (std::isinf(*field.default_number))
    return "unlimited";
  const Json value = plainNumber(unit ? unit->fromSi(*field.default_number) : *field.default_number);
  if (!field.is_list || field.or_scalar)
    return value;
  return std::vector<Json>(static_cast<std::size_t>(field.min_size), value);
}

Json propertyOf(const Field& field, const Unit* unit) {
  Json json{{"description", field.description}};
  const Json element = elementOf(field, unit);
  if (field.is_list) {
    Json list{{"type", "array"}, {"items", element}, {"minItems", field.min_size}, {"maxItems", field.max_size}};
    if (field.is_unique)
      list["uniqueItems"] = true;
    if (field.or_scalar)
      list = {{"anyOf", {element, list}}};
    json.update(list);
  } else {
    json.update(element);
  }
  const Json fallback = defaultOf(field, unit);
  if (!fallback.is_null())
    json["default"] = fallback;
  return json;
}

/// Schema for the forms of a key: exactly one of them, or at most one if optional.
Json choiceOf(const Field& field) {
  Json each = Json::array();
  Json all = Json::array();
  for (const auto& [key, unit] : field.keys()) {
    each.push_back({{"required", {key}}});
    all.push_back(key);
  }
  return field.is_required ? Json{{"oneOf", each}} : Json{{"not", {{"required", all}}}};
}

/// Schema for alternatives: exactly one group is complete, and no key of another one is present.
Json alternativesOf(const Mapping& table) {
  Json groups = Json::array();
  for (const auto& group : table.alternatives) {
    Json present = Json::array(), others = Json::array();
    for (const std::string& field : group) {
      Json keys = Json::array();
      for (const auto& [key, unit] : table.field(field).keys())
        keys.push_back({{"required", {key}}});
      present.push_back({{"anyOf", keys}});
    }
    for (const auto& other : table.alternatives) {
      for (const std::string& field : other) {
        for (const auto& [key, unit] : table.field(field).keys()) {
          if (&other != &group)
            others.push_back({{"required", {key}}});
        }
      }
    }
    groups.push_back({{"allOf", present}, {"not", {{"anyOf", others}}}});
  }
  return groups;
}

Json objectOf(const Mapping& table) {
  Json json{{"description", table.description}, {"type", "object"}, {"additionalProperties", false}};
  Json required = Json::array();
  Json choices = Json::array();
  for (const Field& field : table.fields) {
    const auto keys = field.keys();
    for (const auto& [key, unit] : keys)
      json["properties"][key] = propertyOf(field, unit);
    if (keys.size() > 1) {
      choices.push_back(choiceOf(field));
    } else if (field.is_required) {
      required.push_back(keys[0].first);
    }
  }
  if (!required.empty())
    json["required"] = required;
  if (!choices.empty())
    json["allOf"] = choices;
  if (!table.alternatives.empty())
    json["oneOf"] = alternativesOf(table);
  if (table.exactly_one)
    json["minProperties"] = json["maxProperties"] = 1;
  return json;
}

void collect(const Mapping& table, std::vector<const Mapping*>& all) {
  for (const Field& field : table.fields) {
    if (field.mapping && std::find(all.begin(), all.end(), field.mapping) == all.end()) {
      all.push_back(field.mapping);
      collect(*field.mapping, all);
    }
  }
}

std::vector<const Mapping*> nestedOf(const Mapping& table) {
  std::vector<const Mapping*> all;
  collect(table, all);
  return all;
}

std::string defaultForPeople(const Field& field, bool is_choice) {
  if (field.is_required)
    return "required";
  if (!field.default_note.empty())
    return field.default_note;
  const Unit* unit = field.keys().front().second;
  const Json value = defaultOf(field, unit);
  if (value.is_null())
    return field.type == Type::kMapping ? (is_choice ? "" : "its defaults") : "none";
  std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  if (unit && value != Json("unlimited"))
    text.append(" ").append(unit->forPeople());
  return text;
}

std::string rowOf(const Field& field, bool is_choice) {
  std::vector<std::string> keys;
  for (const auto& [key, unit] : field.keys())
    keys.push_back(std::string("`").append(key).append("`"));
  // The ranges of both units are equal; the table shows the preferred one.
  const Unit* unit = field.keys().front().second;
  const std::string expected = expectation(field, unit) + (field.usual ? "; " + usualForPeople(field, unit) : "");
  return "| " + join(keys, "<br>") + " | " + field.description + " | " + expected + " | " +
         defaultForPeople(field, is_choice) + " |\n";
}

}  // namespace

std::string defaultText(const Field& field) { return defaultForPeople(field, false); }

const std::vector<std::string>& kinds() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> names;
    for (const RobotFile& type : robotFiles())
      names.push_back(type.kind);
    names.insert(names.end(), {"experiment", "deployment", "trajectory", "hardware", "drive", "path"});
    return names;
  }();
  return all;
}

const Mapping& tableOf(const std::string& kind) {
  for (const RobotFile& type : robotFiles()) {
    if (type.kind == kind)
      return type.table();
  }
  if (kind == "experiment")
    return experimentTable();
  if (kind == "deployment")
    return deploymentTable();
  if (kind == "trajectory")
    return trajectoryTable();
  if (kind == "hardware")
    return hardwareTable();
  if (kind == "drive")
    return driveTable();
  if (kind == "path")
    return pathTable();
  throw std::invalid_argument("found the kind '" + kind + "', expected one of " + join(kinds()));
}

Field kindField(const std::string& kind) {
  return text("tandem", "kind and version of the file; the first key").required().oneOf({kind + "/1"});
}

Field robotField() {
  return text("robot", "robot file, relative to the folder of this file, or the name of a preset")
      .required()
      .withoutMotion();
}

std::string schema(const std::string& kind) {
  const Mapping& table = tableOf(kind);
  Json json{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
            {"$id", "urn:tandem:" + kind + ":1"},
            {"$comment", "SPDX-License-Identifier: Apache-2.0; generated from the key tables of config/"},
            {"title", "Tandem " + kind + " file"}};
  json.update(objectOf(table));
  for (const Mapping* nested : nestedOf(table))
    json["$defs"][nested->name] = objectOf(*nested);
  return json.dump(2) + "\n";
}

std::string keyTables(const std::string& kind) {
  const Mapping& table = tableOf(kind);
  std::vector<const Mapping*> all = nestedOf(table);
  all.insert(all.begin(), &table);
  std::string text;
  for (const Mapping* mapping : all) {
    text += std::string(mapping == &table ? "**" : "\n**")
                .append(mapping->name)
                .append("**: ")
                .append(mapping->description) +
            "\n\n";
    text += "| key | meaning | value | default |\n|---|---|---|---|\n";
    for (const Field& field : mapping->fields)
      text += rowOf(field, mapping->exactly_one);
  }
  return text;
}

}  // namespace tandem::config
