// SPDX-License-Identifier: Apache-2.0
#include "config/detail/key_check.h"

#include <algorithm>
#include <vector>

#include "config/suggestion.h"

namespace tandem::config {
namespace {

/// Field whose name the key starts with, as in `outer_diameter_cm`; the longest such name.
const Field* quantityOf(const std::string& key, const Mapping& table) {
  const Field* found = nullptr;
  for (const Field& field : table.fields) {
    if (field.quantity != Quantity::kNone && key.starts_with(field.name + "_") &&
        (!found || field.name.size() > found->name.size())) {
      found = &field;
    }
  }
  return found;
}

std::vector<std::string> namesOf(const Field& field) {
  std::vector<std::string> names;
  for (const auto& [name, unit] : field.keys())
    names.push_back(name);
  return names;
}

}  // namespace

std::string knownKeys(const Mapping& table) {
  std::vector<std::string> keys;
  for (const Field& field : table.fields)
    keys.push_back(field.key());
  return join(keys);
}

bool isMeant(const Field& field, const std::string& key) {
  return key.starts_with(field.name) || !nearestWord(key, namesOf(field)).empty();
}

std::string explainUnknownKey(const std::string& key, const Mapping& table) {
  for (const Field& field : table.fields) {
    if (field.quantity != Quantity::kNone && field.name == key) {
      return "a key without its unit; expected " + field.keysForPeople();
    }
  }
  if (const Field* field = quantityOf(key, table)) {
    const std::string suffix = key.substr(field->name.size() + 1);
    return "'" + suffix + "' is not a unit of " + std::string(name(field->quantity)) + " here; expected " +
           field->keysForPeople();
  }
  std::vector<std::string> known;
  for (const Field& field : table.fields) {
    const std::vector<std::string> names = namesOf(field);
    known.insert(known.end(), names.begin(), names.end());
  }
  const std::size_t end = key.find_first_of(": ");
  if (end != std::string::npos && std::ranges::find(known, key.substr(0, end)) != known.end())
    return "found no colon with a blank after it, expected `" + key.substr(0, end) + ": " +
           key.substr(std::min(key.find_first_not_of(": ", end), key.size())) + "`";
  if (const std::string nearest = nearestWord(key, known); !nearest.empty())
    return "unknown key; did you mean " + nearest + "?";
  return "unknown key; expected one of " + knownKeys(table);
}

}  // namespace tandem::config
